"""The ground as plane surfaces, each the top of a convex box, made from its pieces."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.ground.config import Blocks, Boards, Patch, Piece, Rough, Slope, Stairs

FAR = 1e4  # [m]: half the length of the ground
SIDE = 200.0  # [m]: half its width where it is not flat everywhere
_PIT = 0.1  # [m]: of the floor between stepping blocks below the lowest one


class Surface(NamedTuple):
    """A plane over a rectangle seen from above, with edges along x and y.

    Attributes:
        x0, x1, y0, y1: the rectangle; x0 and y0 belong to it, x1 and y1 don't [m].
        z: height at x0 and the middle of y [m].
        along, across: dz/dx and dz/dy [1].
        friction: None where it is that of the rest of the ground [1].
    """

    x0: float
    x1: float
    y0: float
    y1: float
    z: float
    along: float = 0.0
    across: float = 0.0
    friction: float | None = None

    def height(self, x: float, y: float) -> float:
        """Height of the plane at a place, which may be beyond its edges [m]."""
        return self.z + self.along * (x - self.x0) + self.across * (y - 0.5 * (self.y0 + self.y1))


def surfaces_of(pieces: tuple[Piece, ...], middle: float) -> list[Surface]:
    """The surfaces of pieces in their order along x, and of the level ground around them; z = 0 before the first one.

    Args:
        middle: y of the line along x that the pieces are laid out about [m].
    """
    found: list[Surface] = []
    x, z, right, left = -FAR, 0.0, middle - SIDE, middle + SIDE
    for piece in pieces:
        start, end = piece.span()
        if start > x:
            found.append(Surface(x, start, right, left, z))
        match piece:
            case Stairs():
                edges = [piece.at + i * piece.tread for i in range(piece.count + 1)]
                for i in range(piece.count):
                    z += piece.rise
                    found.append(Surface(edges[i], edges[i + 1], right, left, z, friction=piece.friction))
            case Slope():
                along, across = (math.tan(math.radians(angle)) for angle in (piece.angle_deg, piece.roll_deg))
                found.append(Surface(start, end, right, left, z, along, across, piece.friction))
                z += along * piece.length
            case Patch():
                found.append(Surface(start, end, right, left, z, friction=piece.friction))
            case Blocks():
                floor = z + min(height for *_, height in piece.footsteps) - _PIT
                found.append(Surface(start, end, right, left, floor, friction=piece.friction))
                length, width = piece.size
                for u, v, height in piece.footsteps:
                    around = u - length / 2, u + length / 2, v - width / 2, v + width / 2
                    found.append(Surface(*around, z + height, friction=piece.friction))
            case Boards() | Rough():
                found += _rough(piece, z, middle)
        x = end
    found.append(Surface(x, FAR, right, left, z))
    return found


def _rough(piece: Boards | Rough, z: float, middle: float) -> Iterator[Surface]:
    """The parts of rough ground, and the level ground on both sides of it."""
    start, end = piece.span()
    half = piece.width / 2.0
    yield Surface(start, end, middle - SIDE, middle - half, z, friction=piece.friction)
    yield Surface(start, end, middle + half, middle + SIDE, z, friction=piece.friction)
    length, width = piece.part()
    random = np.random.default_rng(piece.seed)
    rows = round(piece.width / width + 0.499)
    for row in range(rows):
        low, high = middle - half + row * width, min(middle - half + (row + 1) * width, middle + half)
        first = start
        if isinstance(piece, Boards) and row == 0:
            first = min(start + 0.5 * length, end)
            yield Surface(start, first, low, high, z, friction=piece.friction)
        for i in range(math.ceil((end - first) / length - 1e-9)):
            x0, x1 = first + i * length, min(end, first + (i + 1) * length)
            height = z + float(random.uniform(-piece.amplitude, piece.amplitude))
            yield Surface(x0, x1, low, high, height, friction=piece.friction)
