"""How many runs tell where they are: a bar with the time left on a terminal, plain lines otherwise."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tqdm import tqdm

Tell = Callable[[int, str], None]
_LINES = 20  # plain lines a command


@contextmanager
def run_progress(name: str, done: int, total: int) -> Iterator[Tell]:
    """A function to call with the number of runs that have ended and a word on them.

    Args:
        name: shown first.
        done: runs that an earlier command has ended; they don't count towards the pace.
        total: all runs.
    """
    if sys.stderr.isatty():
        with tqdm(total=total, initial=done, desc=name, unit="run", file=sys.stderr) as bar:

            def tell(count: int, words: str) -> None:
                bar.set_postfix_str(words, refresh=False)
                bar.update(count - bar.n)
                bar.refresh()

            yield tell
        return
    yield _lines(name, done, total)


def _lines(name: str, done: int, total: int) -> Tell:
    started, told = time.monotonic(), _LINES * done // total

    def tell(count: int, words: str) -> None:
        nonlocal told
        due = _LINES * count // total
        if due > told:
            told = due
            left = (total - count) * (time.monotonic() - started) / max(count - done, 1)
            print(f"{name}: {count} of {total} runs, about {left:.0f} s left, {words}", file=sys.stderr, flush=True)

    return tell
