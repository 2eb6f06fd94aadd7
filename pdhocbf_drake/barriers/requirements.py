"""What the functions of this package require of barriers and a system, checked where they are given.

Shapes, periods, and the relative degree at each phase. A filter checks up to 200 phases, spread evenly over longer
periods, so that its construction takes no longer for a period of 5,000 ticks than for one of 200: about 1 ms for each
barrier and phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from pdhocbf_drake.barriers.barrier import Barrier
from pdhocbf_drake.barriers.checks import shown
from pdhocbf_drake.barriers.dynamics import PeriodicSystem
from pdhocbf_drake.barriers.relative_degree import check_degrees, phases_of
from pdhocbf_drake.errors import InputError

B = TypeVar("B", bound=Barrier)

_MOST_PHASES = 200


def barrier_list(barriers: Sequence[B]) -> tuple[B, ...]:
    """The barriers as a tuple; raises `InputError` for a single one, or for what is none."""
    if isinstance(barriers, Barrier) or not np.iterable(barriers):
        raise InputError(f"the barriers are a list, given {shown(barriers)}")
    found = tuple(barriers)
    for barrier in found:
        if not isinstance(barrier, Barrier):
            raise InputError(f"the barriers are a list of Barrier or AffineBarrier, given {shown(barrier)} in it")
    return found


def checked_phases(barrier: Barrier, system: PeriodicSystem) -> list[int]:
    """All phases of `phases_of`, or 200 of them spread evenly."""
    phases = phases_of(barrier, system)
    if len(phases) <= _MOST_PHASES:
        return list(phases)
    return [i * len(phases) // _MOST_PHASES for i in range(_MOST_PHASES)]


def check_barriers(barriers: Any, system: PeriodicSystem, states: ArrayLike | None = None) -> tuple[Barrier, ...]:
    """The barriers as a tuple, after the checks of `check_relative_degree` at the phases of `checked_phases`.

    Args:
        states: (S, n), where functions are tried; by default drawn from a standard normal distribution.

    Raises:
        InputError: no barrier, or two of one name; as `check_relative_degree` and `barrier_list`.
    """
    found = barrier_list(barriers)
    names = [barrier.name for barrier in found]
    if not found:
        raise InputError("a filter needs one barrier at least, given none")
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise InputError(f"barriers need names of their own, given two of the name {shown(twice)}")
    for barrier in found:
        check_degrees(barrier, system, checked_phases(barrier, system), states)
    return found
