"""Whether ψ_m of a barrier is affine in the input, as the filter needs it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem
from pdhocbf_drake.barriers.relative_degree import enforced_psi, phases_of
from pdhocbf_drake.errors import InputError

Array = NDArray[np.float64]

_SIZES = ((1e-6, 1e6), (1.0, 1e3), (1.0, 1e-3))  # of inputs at which slopes are compared


def check_affine_in_input(barrier: Barrier, system: PeriodicSystem, lower: Array, upper: Array) -> None:
    """Compares the slopes of ψ_m at pairs of inputs within their limits, at three states for each phase.

    Without limits the inputs are of six magnitudes, so that dynamics which clip their input are found. An affine
    barrier on affine dynamics needs no comparison.

    Raises:
        InputError: two slopes differ.
    """
    if isinstance(barrier, AffineBarrier) and isinstance(system, PeriodicAffineSystem):
        return
    random = np.random.default_rng(0)
    for phase in phases_of(barrier, system):
        for x, sizes in zip(random.standard_normal((len(_SIZES), system.n)), _SIZES, strict=True):
            inputs = [_input_within(lower, upper, size, random) for size in sizes]
            one, other = (enforced_psi(barrier, system, phase, x, u)[1] for u in inputs)
            rounding = 1e-9 * np.abs([one, other]).max(initial=0.0)
            if np.all(np.isfinite([one, other])) and np.any(np.abs(one - other) > rounding):
                raise InputError(
                    f'barrier "{barrier.name}": psi_{barrier.order} is not affine in the input, which the filter '
                    "needs; add_nonlinear_barrier_rows takes any"
                )


def _input_within(lower: Array, upper: Array, size: float, random: np.random.Generator) -> Array:
    """A random input within its limits; of the given size where there are none."""
    low, high = np.isfinite(lower), np.isfinite(upper)
    free = size * random.standard_normal(len(lower))
    one_sided = np.where(low, lower + np.abs(free), np.where(high, upper - np.abs(free), free))
    inside = np.nan_to_num(lower) + random.uniform(size=len(lower)) * np.nan_to_num(upper - lower)
    return np.where(low & high, inside, one_sided)
