"""A barrier along a recorded trajectory: how safe it was, eqs. (5) and (6)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers.barrier import Barrier
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


def record_from_h(h: ArrayLike, class_k: Sequence[ClassK]) -> BarrierRecord:
    """The record of a barrier whose h was logged, shape (T,).

    Raises:
        InputError: the log is empty or holds a value that is not finite.
    """
    values = _recorded(h)
    levels = psi_along(values, class_k)
    last = levels[-1]
    return BarrierRecord(
        levels,
        float(values.min()),
        safety_margin(values),
        int((values < 0).sum()),
        float(last.min()) if last.size else np.nan,
    )


def record(barrier: Barrier, states: ArrayLike, k: int = 0) -> BarrierRecord:
    """The record of a barrier on logged states (T, n), the first one at tick k.

    Raises:
        InputError: as `record_from_h`.
    """
    return record_from_h([float(barrier.h(k + i, x)) for i, x in enumerate(np.asarray(states))], barrier.class_k)


def safety_margin(h: ArrayLike) -> float:
    """h̄ = (1/N_0) Σ_k h(k), eq. (5) [unit of h].

    Raises:
        InputError: the log is empty or holds a value that is not finite.
    """
    return float(_recorded(h).mean())


def margin_ratio(h1: ArrayLike, h2: ArrayLike) -> float:
    """M = h̄_1/h̄_2, eq. (6), as a fraction [1]: M < 1 says that h_1 is the less conservative barrier.

    Raises:
        InputError: as `safety_margin`, or h̄_2 is zero.
    """
    first, second = safety_margin(h1), safety_margin(h2)
    if second == 0:
        raise InputError("the safety margin ratio needs a second margin other than zero, given 0")
    return first / second


def _recorded(h: ArrayLike) -> NDArray[np.float64]:
    values = np.asarray(h, dtype=float)
    if values.ndim != 1 or values.size == 0:
        raise InputError(f"a record of h is a list of at least one number, given shape {values.shape}")
    if not np.all(np.isfinite(values)):
        raise InputError(f"a record of h must be finite, given {values[~np.isfinite(values)][0]} in it")
    return values
