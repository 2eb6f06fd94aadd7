"""What the functions of this package require of barriers and a system, checked where they are given.

Shapes and periods, the relative degree at each phase, and that ψ_m is affine in the input where a quadratic program is
to be solved. A filter checks up to 200 phases, spread evenly over longer periods, so that its construction takes no
longer for a period of 5,000 ticks than for one of 200: about 1 ms for each barrier and phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.checks import shown
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem
from pdhocbf_drake.barriers.relative_degree import check_degrees, enforced_row, phases_of
from pdhocbf_drake.errors import InputError

Array = NDArray[np.float64]

_MOST_PHASES = 200
_SIZES = ((1e-6, 1e6), (1.0, 1e3), (1.0, 1e-3))  # of inputs at which slopes are compared


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
    barrier: Barrier,
    system: PeriodicSystem,
    states: ArrayLike | None,
    lower: Array,
    upper: Array,
    who: str,
    phases: Sequence[int] | None = None,
) -> None:
    """Compares the slopes of ψ_m at inputs of six magnitudes within limits, at some states.

    Args:
        phases: by default those of `checked_phases`.

    Raises:
        InputError: the slopes differ by more than rounding: ψ_m is not affine in the input, which `who` needs.
    """
    if isinstance(barrier, AffineBarrier) and isinstance(system, PeriodicAffineSystem):
        return
    random = np.random.default_rng(0)
    points = random.standard_normal((len(_SIZES), system.n)) if states is None else np.asarray(states, dtype=float)
    for phase in checked_phases(barrier, system) if phases is None else phases:
        for i, x in enumerate(points):
            inputs = [_input_within(lower, upper, size, random) for size in _SIZES[i % len(_SIZES)]]
            one, other = (enforced_row(barrier, system, phase, x, u)[1] for u in inputs)
            rounding = 1e-9 * np.abs([one, other]).max(initial=0.0)
            if np.all(np.isfinite([one, other])) and np.any(np.abs(one - other) > rounding):
                raise InputError(
                    f'barrier "{barrier.name}": psi_{barrier.order} is not affine in the input, which {who} needs; '
                    "NonlinearFilter takes any"
                )


def _input_within(lower: Array, upper: Array, size: float, random: np.random.Generator) -> Array:
    """A random input within its limits; of the given size where there are none."""
    low, high = np.isfinite(lower), np.isfinite(upper)
    free = size * random.standard_normal(len(lower))
    one_sided = np.where(low, lower + np.abs(free), np.where(high, upper - np.abs(free), free))
    inside = np.nan_to_num(lower) + random.uniform(size=len(lower)) * np.nan_to_num(upper - lower)
    return np.where(low & high, inside, one_sided)


def check_barriers(barriers: Any, system: PeriodicSystem, states: ArrayLike | None = None) -> tuple[Barrier, ...]:
    """The barriers as a tuple, after the checks of `check_relative_degree` at the phases of `checked_phases`.

    Args:
        states: (S, n), where functions are tried; by default drawn from a standard normal distribution.

    Raises:
        InputError: as `check_relative_degree` and `barrier_list`.
    """
    found = barrier_list(barriers)
    for barrier in found:
        check_degrees(barrier, system, checked_phases(barrier, system), states)
    return found
