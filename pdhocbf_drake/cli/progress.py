"""How a long run tells where it is: a bar on a terminal, plain lines otherwise."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from tqdm import tqdm

from pdhocbf_drake.stopping import stop_requests

Progress = Callable[[float], None]

_LINES = 10  # plain lines a run, and more where they would be far apart:
_SILENCE = 60.0  # the longest that a run says nothing [s]
_PATIENCE = 10.0  # after this long it says that it is still being prepared [s]


@contextmanager
def shown_progress(name: str, duration: float) -> Iterator[Progress]:
    """A function to call with the simulated time [s] now and then, and which stops the run when that is asked for.

    The first Ctrl-C (or SIGTERM, or SIGHUP) takes effect at the next call, between two ticks, so that the log ends
    with a whole row; the second one at once.
    """
    show = _bar(name, duration) if sys.stderr.isatty() else _lines(name, duration)
    with stop_requests() as requested, show as tell:

        def progress(now: float) -> None:
            tell(now)
            if requested.is_set():
                raise KeyboardInterrupt

        yield progress


@contextmanager
def _bar(name: str, duration: float) -> Iterator[Progress]:
    form = "{desc} {percentage:3.0f}%|{bar}| {n:.1f} of {total:.1f} s [{elapsed}<{remaining}]"
    with tqdm(total=duration, desc=name, bar_format=form, file=sys.stderr) as bar:

        def tell(now: float) -> None:
            bar.update(min(now, duration) - bar.n)

        yield tell


@contextmanager
def _lines(name: str, duration: float) -> Iterator[Progress]:
    started = told_at = time.monotonic()
    told = 0

    def tell(now: float) -> None:
        nonlocal told, told_at
        waiting.cancel()
        due, clock = int(_LINES * now / duration + 1e-9), time.monotonic()
        if due > told or clock - told_at > _SILENCE:
            told, told_at = due, clock
            say(f"{name}: {now:.1f} of {duration:.1f} s simulated in {clock - started:.1f} s")

    waiting = threading.Timer(_PATIENCE, say, [f"{name}: still preparing the controller"])
    waiting.daemon = True
    waiting.start()
    try:
        yield tell
    finally:
        waiting.cancel()


def say(text: str) -> None:
    """One line on standard error; a run goes on when nobody can read it any more."""
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)
