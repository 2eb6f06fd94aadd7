"""What is no longer used: Python's search for reference cycles, and memory that the system gets back."""

from __future__ import annotations

import ctypes
import gc
from collections.abc import Iterator
from contextlib import contextmanager, suppress


@contextmanager
def without_garbage_collection() -> Iterator[None]:
    """Suspends it inside."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


@contextmanager
def freed_at_the_end() -> Iterator[None]:
    """Suspends it inside, and then frees what was made inside and is no longer used, cycles too.

    That takes little time, since nothing inside has aged and only what is young is searched. Python by itself would
    wait until it has many objects, and a diagram is few objects with much memory behind them.
    """
    with without_garbage_collection():
        yield
    gc.collect(0)


@contextmanager
def quick_imports() -> Iterator[None]:
    """Suspends it inside, and leaves out for ever what exists at the end, since modules stay.

    The imports of a command take a sixth longer otherwise.
    """
    with without_garbage_collection():
        try:
            yield
        finally:
            gc.freeze()


def give_back_memory() -> None:
    """Gives freed memory back to the system, where the C library can: glibc keeps what lies between used blocks.

    After the replay of a long run that is a hundred megabytes.
    """
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)
