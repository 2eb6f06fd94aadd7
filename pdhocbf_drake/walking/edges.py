"""Edges of the ground across x, and how far from them a level sole passes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

_BESIDE = 1e-6  # how far from an edge the ground beside it is looked at [m]
_JUMP = 1e-3  # difference of height from which on it is an edge [m]


class Edges(NamedTuple):
    """Edges: x and upper height of each, (n,) [m], and whether the higher ground is ahead of it (+1) or behind (−1)."""

    x: np.ndarray
    top: np.ndarray
    side: np.ndarray

    @classmethod
    def between(cls, low: float, high: float, height: Callable[[float], float], end: Callable[[float], float]) -> Edges:
        """Those of the ground from x = `low` to `high` [m].

        Args:
            height: of the ground at each x [m].
            end: where the surface at each x ends [m].
        """
        found, x = [], end(low)
        while x < high:
            before, after = height(x - _BESIDE), height(x + _BESIDE)
            if abs(after - before) > _JUMP:
                found.append((x, max(before, after), math.copysign(1.0, after - before)))
            x = max(end(x + _BESIDE), x + _BESIDE)
        return cls(*np.array(found).reshape(-1, 3).T)

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
