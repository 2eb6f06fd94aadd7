"""What a program's rows are written in: decision variables, or numbers in their place, and slacks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.solvers import MathematicalProgram
from pydrake.symbolic import Variable

from pdhocbf_drake.barriers.checks import finite_array, shown
from pdhocbf_drake.errors import InputError


def decision_variables(what: str, value: Any) -> NDArray[Any]:
    """An array of decision variables, of any shape.

    Raises:
        InputError: an entry is something else.
    """
    array = np.asarray(value, dtype=object)
    if wrong := [entry for entry in array.ravel() if not isinstance(entry, Variable)]:
        raise InputError(f"{what} must be decision variables, given {shown(wrong[0])}")
    return array


def numbers_or_variables(what: str, value: Any) -> NDArray[Any]:
    """An array of finite floats, or of decision variables (then of objects), of any shape.

    Raises:
        InputError: neither; NaN in a constraint would end the process in Drake.
    """
    array = np.asarray(value, dtype=object)
    if any(isinstance(entry, Variable) for entry in array.ravel()):
        return decision_variables(what, array)
    return finite_array(what, value)


def slack_variables(prog: MathematicalProgram, name: str, slack: Any, count: int) -> NDArray[Any]:
    """The slacks of barrier `name` as a vector of 1 or `count` decision variables, constrained to be ≥ 0.

    Raises:
        InputError: another number of them, or no decision variables.
    """
    slacks = np.atleast_1d(decision_variables(f'barrier "{name}": slacks', slack))
    if slacks.shape not in ((1,), (count,)):
        raise InputError(f'barrier "{name}": 1 slack, or one per row ({count}), is allowed, given {slacks.size}')
    positive = prog.AddBoundingBoxConstraint(0.0, np.inf, slacks)
    positive.evaluator().set_description(f"barrier {name}: slack")
    return slacks
