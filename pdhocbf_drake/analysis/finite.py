"""Numbers of metrics, which are finite or None."""

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
