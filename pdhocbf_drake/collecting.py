"""Python's search for reference cycles, which takes long where many objects are made and few are thrown away."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


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
def quick_imports() -> Iterator[None]:
    """Suspends it inside, and leaves out for ever what exists at the end, since modules stay.

    The imports of a command take a sixth longer otherwise.
    """
    with without_garbage_collection():
        try:
            yield
        finally:
            gc.freeze()
