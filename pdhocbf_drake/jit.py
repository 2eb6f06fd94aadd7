"""Compiles the numeric inner loops of a tick, once per machine: numba keeps the machine code beside the source."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar, cast

import numba
from numba.core.runtime.nrt import rtsys

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """The function as machine code, in which arrays are read and written in place; made at its first call.

    A few arrays of a hundred numbers cost numpy a microsecond for each operation, and a loop over them 0.1.

    Machine code checks no index: shapes are the callers' to check. It may call machine code of its own file alone,
    since what is kept is made anew only when that file changes. Division by zero is inf or NaN, as in numpy.
    """
    try:
        machine_code: Any = numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # neither the source's folder nor the user's cache can be written
        return cast(F, numba.njit(error_model="numpy")(function))
    cache = machine_code._cache
    # Numba's own loading first learns all that Python code might call, which takes longer than all the rest of it, and
    # which what is machine code already has no use for. A numba in which the rest goes by another name does both.
    load, save = getattr(cache, "_load_overload", cache.load_overload), cache.save_overload

    def load_if_whole(signature: object, target: object) -> object:
        try:
            rtsys.initialize(target)
            return load(signature, target)
        except Exception:  # whatever a file says that was torn by a power cut
            with suppress(OSError):
                cache.flush()
            return None  # so that it is made anew

    def save_if_possible(*made: object) -> None:
        with suppress(OSError):  # a full disk, say: then it is made again next time
            save(*made)

    cache.load_overload, cache.save_overload = load_if_whole, save_if_possible
    return cast(F, machine_code)
