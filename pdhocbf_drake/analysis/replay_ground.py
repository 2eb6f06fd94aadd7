"""The ground of a replay as triangles: a tiled top, and the walls where heights differ."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pdhocbf_drake.ground.surfaces import Surface
from pdhocbf_drake.ground.terrain import Terrain

TILE = 0.25  # [m]
_BELOW = 0.002  # [m]: what is drawn lies so far below the ground, so that soles don't flicker through it
_EDGE = 0.012  # [m]: width of the line along the edges of uneven ground
_WALL = 0.1  # [m]: of walls below the lowest ground in sight


class Quads:
    """Quadrilaterals, as vertices (3, 4 n) and triangles (3, 2 n) of Meshcat."""

    def __init__(self) -> None:
        self._corners: list[np.ndarray] = []

    def add(self, corners: np.ndarray) -> None:
        """Adds one with its corners in turn, (4, 3) [m]."""
        self._corners.append(corners)

    def mesh(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Vertices and triangles; None where there are none."""
        if not self._corners:
            return None
        first = 4 * np.arange(len(self._corners))
        faces = np.concatenate([[first, first + 1, first + 2], [first, first + 2, first + 3]], axis=1)
        return np.asfortranarray(np.vstack(self._corners).T), np.asfortranarray(faces, np.int32)


def tops(terrain: Terrain, x: tuple[float, float], y: tuple[float, float]) -> dict[str, Quads]:
    """The ground within limits along x and y [m] as a light and a dark pattern of tiles, its walls and edges."""
    found = {"light": Quads(), "dark": Quads(), "walls": Quads(), "edges": Quads()}
    seen = [part for surface in terrain.surfaces if (part := _within(surface, x, y)) is not None]
    bottom = min(min(part.height(u, v) for u, v in _corners(part)) for part in seen) - _WALL
    for part in seen:
        for x0, x1 in _split(part.x0, part.x1):
            for y0, y1 in _split(part.y0, part.y1):
                tile = part._replace(x0=x0, x1=x1, y0=y0, y1=y1)
                odd = (np.floor((x0 + x1) / 2 / TILE) + np.floor((y0 + y1) / 2 / TILE)) % 2
                found["dark" if odd else "light"].add(_top(part, _corners(tile)))
        if not terrain.flat:
            for edge in _edges(part):
                found["edges"].add(_top(part, _corners(edge), 0.5 * _BELOW))
            top = _top(part, _corners(part))
            low = np.column_stack([top[:, :2], np.full(4, bottom)])
            for i in range(4):
                found["walls"].add(np.array([top[i], top[i - 1], low[i - 1], low[i]]))
    return found


def _within(surface: Surface, x: tuple[float, float], y: tuple[float, float]) -> Surface | None:
    """The part of a surface within limits, as a plane of the same heights."""
    x0, x1 = max(surface.x0, x[0]), min(surface.x1, x[1])
    y0, y1 = max(surface.y0, y[0]), min(surface.y1, y[1])
    if x0 >= x1 or y0 >= y1:
        return None
    return surface._replace(x0=x0, x1=x1, y0=y0, y1=y1, z=surface.height(x0, 0.5 * (y0 + y1)))


def _split(low: float, high: float) -> list[tuple[float, float]]:
    """The stretches between two places and the edges of tiles between them."""
    inner = np.arange(np.floor(low / TILE) + 1, np.ceil(high / TILE)) * TILE
    edges = [low, *inner.tolist(), high]
    return list(pairwise(edges))


def _edges(part: Surface) -> list[Surface]:
    """A line along each side of a surface, without which stairs that are seen from above look like a floor."""
    return [
        part._replace(x1=min(part.x0 + _EDGE, part.x1)),
        part._replace(x0=max(part.x1 - _EDGE, part.x0)),
        part._replace(y1=min(part.y0 + _EDGE, part.y1)),
        part._replace(y0=max(part.y1 - _EDGE, part.y0)),
    ]


def _corners(part: Surface) -> list[tuple[float, float]]:
    return [(part.x0, part.y0), (part.x1, part.y0), (part.x1, part.y1), (part.x0, part.y1)]


def _top(part: Surface, corners: list[tuple[float, float]], below: float = _BELOW) -> np.ndarray:
    return np.array([[u, v, part.height(u, v) - below] for u, v in corners])
