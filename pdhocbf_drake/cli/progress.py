"""How a long run tells where it is: a bar on a terminal, plain lines otherwise; and how it is asked to stop."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from tqdm import tqdm

Progress = Callable[[float], None]

_LINES = 10  # plain lines a run


@contextmanager
def shown_progress(name: str, duration: float) -> Iterator[Progress]:
    """A function to call with the simulated time [s] now and then, and which stops the run when that is asked for.

    The first Ctrl-C (or SIGTERM) takes effect at the next call, between two ticks, so that the log ends with a whole
    row; the second one at once.
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
    started, told = time.monotonic(), 0

    def tell(now: float) -> None:
        nonlocal told
        due = int(_LINES * now / duration + 1e-9)
        if due > told:
            told = due
            elapsed = time.monotonic() - started
            print(f"{name}: {now:.1f} of {duration:.1f} s simulated in {elapsed:.1f} s", file=sys.stderr, flush=True)

    yield tell


@contextmanager
def stop_requests() -> Iterator[threading.Event]:
    """An event that the first Ctrl-C or SIGTERM sets; the second one takes effect at once."""
    requested = threading.Event()

    def ask(number: int, frame: FrameType | None) -> None:
        if requested.is_set():
            raise KeyboardInterrupt
        requested.set()

    if threading.current_thread() is not threading.main_thread():
        yield requested  # Python takes signals in the main thread only
        return
    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield requested
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
