"""Whether ψ_m of a barrier is affine in the input, as quadratic programs need it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem
from pdhocbf_drake.barriers.relative_degree import enforced_row
from pdhocbf_drake.barriers.requirements import checked_phases
from pdhocbf_drake.errors import InputError

Array = NDArray[np.float64]

_SIZES = ((1e-6, 1e6), (1.0, 1e3), (1.0, 1e-3))  # of inputs at which slopes are compared


def check_affine_in_input(
    barrier: Barrier,
    system: PeriodicSystem,
    lower: Array,
    upper: Array,
    who: str,
    states: ArrayLike | None = None,
    phases: Sequence[int] | None = None,
) -> None:
    """Compares the slopes of ψ_m at pairs of inputs within their limits, at some states for each phase.

    Without limits the inputs are of six magnitudes, so that dynamics which clip their input are found. An affine
    barrier on affine dynamics needs no comparison.

    Args:
        who: what needs it, for the message.
        states: (S, n), by default three drawn from a standard normal distribution.
        phases: by default those of `checked_phases`.

    Raises:
        InputError: two slopes differ.
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
