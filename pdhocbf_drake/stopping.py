"""Requests to stop a command: Ctrl-C, SIGTERM, and SIGHUP when its terminal closes."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def stop_requests() -> Iterator[threading.Event]:
    """An event, which the first request to stop sets; the second request raises `KeyboardInterrupt`."""
    requested = threading.Event()

    def request(number: int, frame: FrameType | None) -> None:
        if requested.is_set():
            raise KeyboardInterrupt
        requested.set()

    with _handled_by(request):
        yield requested


@contextmanager
def interruptible() -> Iterator[None]:
    """Every request to stop raises `KeyboardInterrupt` inside, so that `finally` clauses run."""
    with _handled_by(signal.default_int_handler):
        yield


@contextmanager
def ctrl_c_blocked() -> Iterator[None]:
    """Blocks Ctrl-C for the threads and processes that start in the block, since a terminal sends it to all of them."""
    from multiprocessing import resource_tracker  # here, for a quick start

    resource_tracker.ensure_running()  # started later, it would unblock SIGINT
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _handled_by(handler: Callable[[int, FrameType | None], Any]) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread can set signal handlers
        return
    # Signals that the process ignores, as under nohup, stay ignored.
    numbers = [number for number in _SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)
