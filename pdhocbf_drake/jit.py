"""Compilation of numeric inner loops to machine code, once per machine: numba caches it beside the source."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar, cast

import numba
from numba import config
from numba.core.runtime.nrt import rtsys

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """The function as machine code that reads and writes arrays in place, compiled or loaded at its first call.

    On arrays of a hundred numbers numpy takes a microsecond for each operation, a compiled loop 0.1.

    Compiled functions (kernels) check no index: shapes are checked by their callers. Each room has its kernels in
    `kernels.py`, those of a large part in `PART_kernels.py`, and a kernel calls only those of its own file, because
    numba recompiles it only when that file changes. A test compares each of them with a few lines of numpy, or holds
    what it is for. Division by zero is inf or NaN, as in numpy.

    With NUMBA_DISABLE_JIT=1 in the environment it is the function itself, for debuggers and for counting covered lines.
    """
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return function
    try:
        machine_code: Any = numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # neither the source's folder nor the user's cache is writable
        return cast(F, numba.njit(error_model="numpy")(function))
    cache = machine_code._cache
    # Numba's own loading first registers all that Python code might call. That takes longer than the rest of the
    # loading, and cached machine code does not need it. A version of numba without that name does both.
    load, save = getattr(cache, "_load_overload", cache.load_overload), cache.save_overload

    def load_if_intact(signature: object, target: object) -> object:
        try:
            rtsys.initialize(target)
            return load(signature, target)
        except Exception:  # a damaged file can raise anything
            with suppress(OSError):
                cache.flush()
            return None  # compiles it again

    def save_if_possible(*overload: object) -> None:
        with suppress(OSError):  # a full disk, for example: it is compiled again in the next process
            save(*overload)

    cache.load_overload, cache.save_overload = load_if_intact, save_if_possible
    return cast(F, machine_code)
