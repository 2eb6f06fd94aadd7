"""A barrier along a recorded trajectory: its least and mean h, violations, and margins, eqs. (5) and (6)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers.barrier import Barrier
from pdhocbf_drake.barriers.checks import finite_array, number_array, whole_ticks
from pdhocbf_drake.barriers.class_k import ClassK
from pdhocbf_drake.barriers.recursion import psi_along
from pdhocbf_drake.errors import InputError


class BarrierRecord(NamedTuple):
    """A barrier on T recorded states.

    Attributes:
        psi: ψ_0 = h, …, ψ_m; ψ_i has shape (T−i,) [unit of h].
        h_min, h_mean: least and mean h; the mean is the safety margin (5) [unit of h].
        violations: number of ticks with h < 0.
        psi_min: least ψ_m [unit of h]; NaN for a record of m ticks or fewer.
    """

    psi: list[NDArray[np.float64]]
    h_min: float
    h_mean: float
    violations: int
    psi_min: float

    @property
    def h(self) -> NDArray[np.float64]:
        """h along the record, (T,) [unit]."""
        return self.psi[0]

    def __repr__(self) -> str:
        return (
            f"BarrierRecord(h_min={self.h_min:.6g}, h_mean={self.h_mean:.6g}, violations={self.violations} of "
            f"{len(self.h)} ticks, psi_min={self.psi_min:.6g})"
        )


def record_from_h(h: ArrayLike, class_k: Sequence[ClassK | float]) -> BarrierRecord:
    """The record of a barrier whose h was logged, shape (T,); raises `InputError` if it is empty or not finite."""
    values = _recorded(h)
    levels = psi_along(values, class_k)
    psi_min = float(levels[-1].min()) if levels[-1].size else np.nan
    return BarrierRecord(levels, float(values.min()), safety_margin(values), int((values < 0).sum()), psi_min)


def record(barrier: Barrier, states: ArrayLike, k: int = 0) -> BarrierRecord:
    """The record of a barrier on logged states (T, n), the first one at tick k.

    Raises:
        InputError: as `record_from_h`; or the states are not that array, or have another size than the barrier takes.
    """
    k, points = whole_ticks("the tick k", k), number_array("the recorded states", states)
    if points.ndim != 2:
        raise InputError(f"the recorded states must have shape (T, n), given {points.shape}")
    points = points.astype(float) if points.dtype.kind in "iu" else points
    return record_from_h([float(barrier.h(k + i, x)) for i, x in enumerate(points)], barrier.class_k)


def safety_margin(h: ArrayLike) -> float:
    """h̄ = (1/N_0) Σ_k h(k), eq. (5) [unit of h].

    Raises:
        InputError: the log is empty, holds a value that is not finite, or is too large for its mean to be finite.
    """
    values = _recorded(h)
    with np.errstate(over="ignore"):
        mean = float(values.mean())
    if not np.isfinite(mean):
        raise InputError(f"the mean of the recorded h is not finite; its largest is {np.abs(values).max():g}")
    return mean


def margin_ratio(h1: ArrayLike, h2: ArrayLike) -> float:
    """M = h̄_1/h̄_2, eq. (6), as a fraction [1]: M < 1 means that h_1 is the less conservative barrier.

    Raises:
        InputError: as `safety_margin`, or h̄_2 is zero, or so small that M is not finite.
    """
    first, second = safety_margin(h1), safety_margin(h2)
    if second == 0 or not np.isfinite(first / second):
        raise InputError(f"the safety margin ratio needs a second margin other than zero, given {second:g}")
    return first / second


def _recorded(h: ArrayLike) -> NDArray[np.float64]:
    values = finite_array("a record of h", h)
    if values.ndim != 1 or values.size == 0:
        raise InputError(f"a record of h is a list of at least one number, given shape {values.shape}")
    return values
