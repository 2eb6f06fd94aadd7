"""Checks of arguments: numbers, ticks, vectors and decision variables.

Each returns the value in its final type, or raises an `InputError` whose message begins with `what`. The public
functions call them once, where a value is given, so that no tick of a control loop repeats them.
"""

from __future__ import annotations

from functools import cache
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.errors import InputError

_SHOWN = 100  # longest text of a given value in a message


def is_number(value: Any) -> bool:
    """Whether the value is one real number, of Python's types or NumPy's; True and False are not."""
    return isinstance(value, Real) and not isinstance(value, bool)


def one_number(what: str, value: Any) -> Any:
    """One number: of Python's types or NumPy's, AutoDiffXd or symbolic; raises `InputError` for arrays, None, …"""
    single = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if is_number(single) or isinstance(single, _scalars()):
        return single
    shape = f" of shape {value.shape}" if isinstance(value, np.ndarray) else ""
    raise InputError(f"{what} must be one number, given {shown(value)}{shape}")


def finite_number(what: str, value: Any, least: float | None = None) -> float:
    """A finite number, `least` or more; raises `InputError` for anything else."""
    if is_number(value) and np.isfinite(value) and (least is None or value >= least):
        return float(value)
    raise InputError(f"{what} must be a finite number{_at_least(least)}, given {shown(value)}")


def whole_ticks(what: str, value: Any, least: int | None = None, most: int | None = None) -> int:
    """A whole number of ticks from `least` to `most`; raises `InputError` for anything else."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if whole and (least is None or value >= least) and (most is None or value <= most):
        return int(value)
    limit = _at_least(least) + (f" and at most {most}" if most is not None else "")
    raise InputError(f"{what} is a whole number of ticks{limit}, given {shown(value)}")


def number_array(what: str, value: Any) -> NDArray[Any]:
    """An array of any shape, of numbers or of objects such as AutoDiffXd and decision variables.

    Raises:
        InputError: the value is text, a ragged list, or anything else that is no array of numbers; or a masked array
            with an entry that is masked.
    """
    if _has_masked(value):
        raise InputError(f"{what} must be an array of numbers, given one with masked entries: {shown(value)}")
    try:
        array = np.asarray(value)
    except ValueError:  # ragged
        array = np.asarray("")
    if array.dtype.kind not in "biufO" or (array.ndim == 0 and array.item() is None):
        raise InputError(f"{what} must be an array of numbers, given {shown(value)}")
    return array


def finite_array(what: str, value: Any) -> NDArray[np.float64]:
    """An array of finite floats of any shape; raises `InputError` as `number_array`, or if an entry is not finite."""
    array = number_array(what, value)
    try:
        floats = np.asarray(array, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{what} must be an array of numbers, given {shown(value)}") from None
    if not np.all(np.isfinite(floats)):
        raise InputError(f"{what} must be finite, given {floats[~np.isfinite(floats)][0]} in it")
    return floats


def vector(what: str, value: Any, size: int) -> NDArray[Any]:
    """A vector of numbers or objects, (size,), finite or not; raises `InputError` as `number_array`, or for a shape."""
    array = number_array(what, value)
    if array.shape != (size,):
        raise InputError(f"{what} must have shape ({size},), given {array.shape}")
    return array


def finite_vector(what: str, value: Any, size: int) -> NDArray[np.float64]:
    """A vector of finite floats, (size,); raises `InputError` as `vector`, or if an entry is not finite."""
    return finite_array(what, vector(what, value, size))


def decision_variables(what: str, value: Any) -> NDArray[Any]:
    """An array of decision variables, of any shape; raises `InputError` if an entry is something else."""
    array = np.asarray(value, dtype=object)
    if wrong := [entry for entry in array.ravel() if not isinstance(entry, _variable())]:
        raise InputError(f"{what} must be decision variables, given {shown(wrong[0])}")
    return array


def numbers_or_variables(what: str, value: Any) -> NDArray[Any]:
    """An array of finite floats, or of decision variables (then of objects), of any shape.

    Raises:
        InputError: an entry is neither; NaN in a constraint would end the process in Drake.
    """
    array = np.asarray(value, dtype=object)
    if any(isinstance(entry, _variable()) for entry in array.ravel()):
        return decision_variables(what, array)
    return finite_array(what, value)


@cache
def _scalars() -> tuple[type, ...]:
    """What stands for one number in Drake; imported here, so that a scenario is read, and refused, without Drake."""
    from pydrake.autodiffutils import AutoDiffXd
    from pydrake.symbolic import Expression

    return AutoDiffXd, Expression, _variable()


@cache
def _variable() -> type:
    from pydrake.symbolic import Variable

    return Variable


def _has_masked(value: Any) -> bool:
    """Whether a masked entry is in an array or in lists of arrays; NumPy would take the number behind the mask."""
    if type(value) is np.ndarray:
        return False
    if isinstance(value, (list, tuple)):
        return any(_has_masked(entry) for entry in value if not isinstance(entry, (float, int)))
    return bool(np.ma.is_masked(value))


def shown(value: Any) -> str:
    """A value as Python writes it, on one line and cut where it is long (`config.shown` writes YAML)."""
    text = " ".join(repr(value).split())
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def _at_least(least: float | None) -> str:
    return "" if least is None else f", at least {least:g}"
