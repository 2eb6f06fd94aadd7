"""The ground that a walk is planned on, where it is not level."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.ground.config import Blocks
from pdhocbf_drake.ground.terrain import Terrain
from pdhocbf_drake.walking.edges import Edges
from pdhocbf_drake.walking.swing_profile import SwingProfile, Timing, candidates

ROOM = 0.002
"""How far a sole in its window stays from an edge [m]."""
CLEARANCE = 0.012
"""How far a swinging sole is planned to stay from edges [m]; what tracking needs of it leaves 5 mm."""
_PROFILES = 256  # kept


class Under(NamedTuple):
    """The ground under a foot: its height [m], ∂z/∂x and ∂z/∂y, and the window of the foot's centre along x [m]."""

    height: float
    slope: tuple[float, float]
    window: tuple[float, float]


class KnownGround:
    """Ground by a map, as soles of one length meet it.

    Attributes:
        terrain: the ground.
        half: half length of the soles, with what touches the ground beyond them [m].
        stones: x and y of the stepping blocks on the map, in their order, one a step [m].
    """

    def __init__(self, terrain: Terrain, half: float) -> None:
        self.terrain, self.half = terrain, half
        blocks = [piece for piece in terrain.pieces if piece.known and isinstance(piece, Blocks)]
        self.stones = [(x, y) for piece in blocks for x, y, _ in sorted(piece.footsteps)]
        self.under = lru_cache(maxsize=1024)(self._under)
        self.swing = lru_cache(maxsize=_PROFILES)(self._swing)

    def _under(self, x: float, y: float) -> Under:
        normal = self.terrain.normal(x, y)
        slope = -float(normal[0] / normal[2]) + 0.0, -float(normal[1] / normal[2]) + 0.0
        return Under(self.terrain.height(x, y), slope, self.terrain.window(x, y, self.half + ROOM))

    def next_surface(self, x: float, y: float) -> tuple[float, float]:
        """The window on the surface that follows along x on the one at a place [m]."""
        edge = self.under(x, y).window[1] + self.half + ROOM
        return self.under(edge + 1e-6, y).window

    def edges(self, start: tuple[float, float], end: tuple[float, float]) -> Edges:
        """The edges that a sole passes on its way from `start` to `end`, x and y [m]."""
        reach = self.half + 0.05
        low, high = min(start[0], end[0]) - reach, max(start[0], end[0]) + reach
        return Edges.between(
            lambda x: self.terrain.height(x, start[1] if x < 0.5 * (low + high) else end[1]), low, high
        )

    def clearance(
        self, profile: SwingProfile, timing: Timing, start: tuple[float, float], end: tuple[float, float]
    ) -> float:
        """The least distance of a sole from the edges on its way [m]; infinite where there are none."""
        edges = self.edges(start, end)
        return edges.least_distance(*self._way(profile, timing, start, end), self.half) if edges else math.inf

    def _swing(
        self, start: tuple[float, float], end: tuple[float, float], timing: Timing, apex: float
    ) -> SwingProfile:  # fmt: skip
        """The gentlest profile that clears the edges by `CLEARANCE`; where none does, the one that clears them most."""
        edges, best, most = self.edges(start, end), SwingProfile(apex=apex), -math.inf
        if not edges:
            return best
        rise = self.under(*end).height - self.under(*start).height
        for profile in candidates(timing, apex, end[0] - start[0], rise):
            least = edges.least_distance(*self._way(profile, timing, start, end), self.half)
            if least >= CLEARANCE:
                return profile
            if least > most:
                best, most = profile, least
        return best

    def _way(
        self, profile: SwingProfile, timing: Timing, start: tuple[float, float], end: tuple[float, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """x and height of a sole's centre at the ticks of a swing [m]."""
        ahead, changed, up = profile.shares(timing)
        x, y = (np.array(a) + ahead * (b - a) for a, b in zip(start, end, strict=True))
        grounds = []
        for place in (start, end):
            height, (along, across), _ = self.under(*place)
            grounds.append(height + along * (x - place[0]) + across * (y - place[1]))
        return x, grounds[0] + changed * (grounds[1] - grounds[0]) + up
