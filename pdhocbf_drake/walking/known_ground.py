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
CLEARANCE = 0.014
"""How far a swinging sole is planned to stay from edges [m]; what tracking needs of it leaves 5 mm."""
_PROFILES = 256  # kept


class Under(NamedTuple):
    """The ground under a foot: its height [m], ∂z/∂x and ∂z/∂y, and the window of the foot's centre along x [m]."""

    height: float
    slope: tuple[float, float]
    window: tuple[float, float]


class Stones(NamedTuple):
    """Stepping blocks of one piece: where they begin along x, and x and y of each in their order, one a step [m]."""

    start: float
    places: tuple[tuple[float, float], ...]


class KnownGround:
    """Ground by a map, as soles of one length meet it.

    Attributes:
        terrain: the ground.
        half: half length of the soles, with what touches the ground beyond them [m].
        stones: the stepping blocks on the map, in the order of their pieces.
    """

    def __init__(self, terrain: Terrain, half: float) -> None:
        self.terrain, self.half = terrain, half
        blocks = [piece for piece in terrain.pieces if piece.known and isinstance(piece, Blocks)]
        self.stones = tuple(
            Stones(piece.span()[0], tuple((x, y) for x, y, _ in sorted(piece.footsteps))) for piece in blocks
        )
        self.under = lru_cache(maxsize=1024)(self._under)
        self.swing = lru_cache(maxsize=_PROFILES)(self._swing)
        self._clearing = lru_cache(maxsize=_PROFILES)(self._clearing_swing)

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
        middle, terrain = 0.5 * (low + high), self.terrain

        def y(x: float) -> float:
            return (start if x < middle else end)[1]

        return Edges.between(low, high, lambda x: terrain.height(x, y(x)), lambda x: terrain.window(x, y(x), 0.0)[1])

    def clearance(
        self, profile: SwingProfile, timing: Timing, start: tuple[float, float], end: tuple[float, float]
    ) -> float:
        """The least distance of a sole from the edges on its way [m]; infinite where there are none."""
        edges, here, there = self.edges(start, end), self.under(*start), self.under(*end)
        if not edges:
            return math.inf
        way, rise = (end[0] - start[0], end[1] - start[1]), there.height - here.height
        x, z = _path(profile, timing, way, rise, here.slope, there.slope)
        return edges.least_distance(start[0] + x, here.height + z, self.half)

    def _swing(
        self, start: tuple[float, float], end: tuple[float, float], timing: Timing, apex: float
    ) -> SwingProfile:  # fmt: skip
        edges = self.edges(start, end)
        if not edges:
            return SwingProfile(apex=apex)
        # Counted from the start, so that all steps of a staircase are one.
        here, there = self.under(*start), self.under(*end)
        kept = tuple((edges.x - start[0]).round(5)), tuple((edges.top - here.height).round(5)), tuple(edges.side)
        way, rise = (end[0] - start[0], end[1] - start[1]), there.height - here.height
        return self._clearing(
            kept, (round(way[0], 5), round(way[1], 5)), round(rise, 5), here.slope, there.slope, timing, apex
        )

    def _clearing_swing(
        self, edges: tuple[tuple[float, ...], ...], way: tuple[float, float], rise: float,
        slope: tuple[float, float], other: tuple[float, float], timing: Timing, apex: float,
    ) -> SwingProfile:  # fmt: skip
        """The gentlest profile that clears the edges by `CLEARANCE`, or by as much as the sole does where it stands.

        Where none does, the one that clears them most.
        """
        passed, best, most = Edges(*map(np.array, edges)), SwingProfile(apex=apex), -math.inf
        standing = passed.least_distance(np.array([0.0, way[0]]), np.array([0.0, rise]), self.half)
        enough = min(CLEARANCE, standing - 1e-9)
        for profile in candidates(timing, apex, way[0], rise):
            path = _path(profile, timing, way, rise, slope, other)
            least = passed.least_distance(*path, self.half)
            if least >= enough:
                return profile
            if least > most:
                best, most = profile, least
        return best


def _path(
    profile: SwingProfile, timing: Timing, way: tuple[float, float], rise: float, slope: tuple[float, float],
    other: tuple[float, float],
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """x and height of a sole's centre at the ticks of a swing, from where it starts [m].

    Args:
        way: along x and y [m]. rise: of the ground [m]. slope, other: of the ground at the start and at the end.
    """
    ahead, changed, up = profile.shares(timing)
    left = ahead * (slope[0] * way[0] + slope[1] * way[1])
    comes_to = rise - (1.0 - ahead) * (other[0] * way[0] + other[1] * way[1])
    return ahead * way[0], left + changed * (comes_to - left) + up
