"""Numbers of metrics, which are finite or None, and when something acted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def statistic(function: Callable[[Array], Any], values: Array) -> float | None:
    """The function of the values; None where there are none, or where it is not finite."""
    return finite(function(values)) if len(values) else None


def finite(value: float | np.floating) -> float | None:
    """The value; None, which JSON writes as null, for NaN or infinity."""
    return float(value) if np.isfinite(value) else None


def active(time: Array, acted: NDArray[np.bool_]) -> dict[str, Any]:
    """At how many ticks something acted, `active_ticks`, and at which time first, `active_first` [s] or None."""
    return {"active_ticks": int(acted.sum()), "active_first": float(time[acted][0]) if acted.any() else None}
