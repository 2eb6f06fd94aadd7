"""Edges of the ground across x, and how far from them a level sole passes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

_STEP = 0.002  # between the places at which the ground is looked at [m]
_JUMP = 0.003  # height between two of them from which on it is an edge [m]


class Edges(NamedTuple):
    """Edges: x and upper height of each, (n,) [m], and whether the higher ground is ahead of it (+1) or behind (−1)."""

    x: np.ndarray
    top: np.ndarray
    side: np.ndarray

    @classmethod
    def between(cls, height: Callable[[float], float], low: float, high: float) -> Edges:
        """Those of the ground of a height at each x, from `low` to `high` [m]."""
        places = np.arange(low, high + _STEP, _STEP)
        heights = np.array([height(x) for x in places.tolist()])
        jumps = np.flatnonzero(np.abs(np.diff(heights)) > _JUMP)
        top = np.maximum(heights[jumps], heights[jumps + 1])
        return cls(places[jumps] + 0.5 * _STEP, top, np.sign(heights[jumps + 1] - heights[jumps]))

    def __bool__(self) -> bool:
        return bool(len(self.x))

    def least_distance(self, x: np.ndarray, z: np.ndarray, half: float) -> float:
        """The least distance of a sole from any edge, negative where it is inside the ground [m].

        Args:
            x, z: of the sole's centre, on its way, (T,) [m]. half: its half length [m].
        """
        above = z[:, None] - self.top
        # Along x, from the sole's end on the lower side of the edge: positive where the sole has not come to it.
        gap = np.maximum((self.x - x[:, None]) * self.side - half, 0.0)
        beyond = (x[:, None] - self.x) * self.side > half  # all of it on or above the higher ground
        apart = np.where(above >= 0.0, np.hypot(gap, above), gap)
        distance = np.where(gap > 0.0, apart, above)
        return float(np.where(beyond, np.inf, distance).min())
