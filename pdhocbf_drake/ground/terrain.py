"""The ground under a walk: height, normal and friction at a place, and how far a sole may move on one surface."""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.ground.config import Piece, in_order
from pdhocbf_drake.ground.surfaces import Surface, surfaces_of

_SAME = 1e-9  # [m, 1]: by which planes of one surface may differ


class _Surfaces:
    """Surfaces, and the highest one at a place."""

    def __init__(self, surfaces: list[Surface]) -> None:
        self.all = surfaces
        self._edges = np.array([[s.x0, s.x1, s.y0, s.y1] for s in surfaces]).T

    def at(self, x: float, y: float) -> Surface:
        x0, x1, y0, y1 = self._edges
        over = np.flatnonzero((x0 <= x) & (x < x1) & (y0 <= y) & (y < y1)).tolist()
        if not over:  # beyond the end of the ground
            return Surface(-math.inf, math.inf, -math.inf, math.inf, 0.0)
        return max((self.all[i] for i in over), key=lambda surface: surface.height(x, y))


class Terrain:
    """The ground in world axes, z = 0 where the walk starts.

    Attributes:
        pieces: in their order along x.
        flat: whether there are none.
        surfaces: of the true ground. Each is the top of a convex box, see `bodies.add_ground`.

    Args:
        pieces: of the ground.
        start: x and y of the walk's start [m].
        friction: of what has none of its own [1].

    Raises:
        ValueError: two pieces are at one place.
    """

    def __init__(
        self, pieces: tuple[Piece, ...] = (), start: tuple[float, float] = (0.0, 0.0), friction: float = 0.8
    ) -> None:
        self.pieces, self.flat, self._friction = in_order(pieces), not pieces, friction
        mapped = tuple(piece for piece in self.pieces if piece.known)
        self._true = _from_start(self.pieces, start)
        self._map = self._true if mapped == self.pieces else _from_start(mapped, start)
        self.surfaces = tuple(self._true.all)

    def height(self, x: float, y: float, known: bool = True) -> float:
        """Of the ground at a place, by the map, or else the true one [m]."""
        return 0.0 if self.flat else self._at(x, y, known).height(x, y)

    def normal(self, x: float, y: float, known: bool = True) -> np.ndarray:
        """Unit normal of the ground at a place, upwards, by the map, or else the true one (3,)."""
        surface = self._at(x, y, known)
        normal = np.array([-surface.along, -surface.across, 1.0])
        return normal / np.linalg.norm(normal)

    def friction(self, x: float, y: float, known: bool = False) -> float:
        """Coulomb coefficient of sole and ground at a place, the true one, or else by the map [1]."""
        own = self._at(x, y, known).friction
        return self._friction if own is None else own

    def window(self, x: float, y: float, half: float, known: bool = True) -> tuple[float, float]:
        """x of a sole's centre, from and to, such that the sole stands wholly on the surface at a place [m].

        The first is above the second where the surface is shorter than the sole.

        Args:
            half: half length of the sole, and how far it is to stay from edges [m].
        """
        surface = self._at(x, y, known)
        low, high = surface.x0, surface.x1
        while math.isfinite(low) and _continues(surface, before := self._at(low - _SAME, y, known), y):
            low = before.x0
        while math.isfinite(high) and _continues(surface, after := self._at(high, y, known), y):
            high = after.x1
        return low + half, high - half

    def _at(self, x: float, y: float, known: bool) -> Surface:
        return (self._map if known else self._true).at(x, y)


def _from_start(pieces: tuple[Piece, ...], start: tuple[float, float]) -> _Surfaces:
    """The surfaces of pieces with z = 0 where the walk starts."""
    found = _Surfaces(surfaces_of(pieces, start[1]))
    height = found.at(*start).height(*start)
    return found if height == 0.0 else _Surfaces([s._replace(z=s.z - height) for s in found.all])


def _continues(one: Surface, other: Surface, y: float) -> bool:
    """Whether two surfaces are one plane along x."""
    there = one.height(other.x0, y) - other.height(other.x0, y)
    return max(abs(there), abs(one.along - other.along), abs(one.across - other.across)) < _SAME
