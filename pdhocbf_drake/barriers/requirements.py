"""What the functions of this package require of barriers and a system, checked where they are given.

Shapes and periods, the relative degree at each phase, and that ψ_m is affine in the input where a quadratic program is
to be solved. A filter checks up to 200 phases, spread evenly over longer periods, so that its construction takes no
longer for a period of 5,000 ticks than for one of 200: about 1 ms for each barrier and phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.checks import shown
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem
from pdhocbf_drake.barriers.relative_degree import check_degrees, enforced_row, phases_of
from pdhocbf_drake.errors import InputError

_MOST_PHASES = 200


def barrier_list(barriers: Any) -> tuple[Barrier, ...]:
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


def check_affine_in_input(
    barrier: Barrier, system: PeriodicSystem, phases: Sequence[int], states: ArrayLike | None, who: str
) -> None:
    """Compares the gradient of ψ_m at two inputs, the second of which moves h by as much as the state is large.

    Raises:
        InputError: the gradients differ by more than rounding: ψ_m is not affine in the input, which `who` needs.
    """
    if isinstance(barrier, AffineBarrier) and isinstance(system, PeriodicAffineSystem):
        return
    random = np.random.default_rng(0)
    points = random.standard_normal((3, system.n)) if states is None else np.asarray(states, dtype=float)
    for phase, x in ((k, x) for k in phases for x in points):
        first, gradient, size = enforced_row(barrier, system, phase, x, np.zeros(system.m))
        steepness = float(np.abs(gradient).max())
        reach = max(size, abs(first)) / steepness if np.isfinite(first) and steepness > 0 else 1.0
        for scale in {1.0, reach}:
            _, other, _ = enforced_row(barrier, system, phase, x, scale * random.standard_normal(system.m))
            if np.any(np.abs(other - gradient) > 1e-9 * np.maximum(steepness, np.abs(other).max())):
                raise InputError(
                    f'barrier "{barrier.name}": psi_{barrier.order} is not affine in the input, which {who} needs; '
                    "NonlinearFilter takes any"
                )


def check_barriers(
    barriers: Any, system: PeriodicSystem, states: ArrayLike | None = None, affine_for: str | None = None
) -> tuple[Barrier, ...]:
    """The barriers as a tuple, after the checks of this module at the phases of `checked_phases`.

    Args:
        states: (S, n), where functions are tried; by default drawn from a standard normal distribution.
        affine_for: who needs ψ_m affine in the input, for the message; None where it may be nonlinear.

    Raises:
        InputError: as `check_relative_degree`, `barrier_list` and `check_affine_in_input`.
    """
    found = barrier_list(barriers)
    for barrier in found:
        phases = checked_phases(barrier, system)
        check_degrees(barrier, system, phases, states)
        if affine_for is not None:
            check_affine_in_input(barrier, system, phases, states, affine_for)
    return found
