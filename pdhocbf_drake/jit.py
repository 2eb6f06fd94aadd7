"""The decorator of all numeric inner loops: numba compiles them once per machine, and loads them from then on."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar, cast

import numba
from numba.core.runtime.nrt import rtsys

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """The function as machine code, compiled at its first call; it reads and writes arrays in place.

    On arrays of a hundred numbers each numpy operation takes a microsecond, and a compiled loop a tenth of that.

    Machine code checks no index: callers check shapes. A compiled function may call compiled functions of its own file
    only, since numba compiles anew when that file changes and not when another one does. Division by zero gives inf
    or NaN, as in numpy.
    """
    try:
        machine_code: Any = numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # neither the source's folder nor the user's cache can be written
        return cast(F, numba.njit(error_model="numpy")(function))
    cache = machine_code._cache
    # Before it loads machine code, numba registers all that Python code might call, as only compiling needs. That takes
    # most of the loading time, so it is left out here, unless this numba has another name for what follows it.
    load, save = getattr(cache, "_load_overload", cache.load_overload), cache.save_overload

    def load_if_whole(signature: object, target: object) -> object:
        try:
            rtsys.initialize(target)
            return load(signature, target)
        except Exception:  # whatever reading a damaged file raises
            with suppress(OSError):
                cache.flush()
            return None  # so that it is compiled anew

    def save_if_possible(*made: object) -> None:
        with suppress(OSError):  # a full disk, say: then it is compiled again next time
            save(*made)

    cache.load_overload, cache.save_overload = load_if_whole, save_if_possible
    return cast(F, machine_code)
