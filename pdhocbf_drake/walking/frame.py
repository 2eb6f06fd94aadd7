"""The stance frame: the world's axes, turned by the heading of the stance foot, about the world's origin.

VHIP (22) is the same in every yawed frame, so one compiled program plans in all of them.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np


@lru_cache(maxsize=16)
def rotation(angle: float) -> np.ndarray:
    """R(angle), counter-clockwise, shape (2, 2); do not write into it. The angle is in rad."""
    c, s = math.cos(angle), math.sin(angle)
    matrix = np.array([[c, -s], [s, c]])
    matrix.flags.writeable = False
    return matrix


def turned(vector: tuple[float, float], angle: float) -> tuple[float, float]:
    """R(angle) · vector."""
    c, s = math.cos(angle), math.sin(angle)
    return c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]


def inner_share(low: np.ndarray, high: np.ndarray, angle: float) -> float:
    """The largest t ≤ 1 with R(angle) · t [low, high] inside the box [low, high], which holds 0; for shapes (2,).

    So t [low, high], along axes that are turned by `angle` [rad], is the largest similar rectangle inside the box.
    """
    c, s = math.cos(angle), math.sin(angle)
    share = 1.0
    for x in (float(low[0]), float(high[0])):
        for y in (float(low[1]), float(high[1])):
            for value, least, most in zip((c * x - s * y, s * x + c * y), low, high, strict=True):
                if value > most:
                    share = min(share, float(most) / value)
                elif value < least:
                    share = min(share, float(least) / value)
    return share


def inner_box(low: np.ndarray, high: np.ndarray, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """A box [least, most] about 0 with R(angle) · [least, most] inside the box [low, high]; for shapes (2,).

    The largest similar rectangle, whose sides then go out, those across x first, to the edges of [low, high] or to the
    same number there. Where 0 lies on an edge, the similar rectangle is a point, and this box goes to one side of it.
    """
    c, s, share = math.cos(angle), math.sin(angle), inner_share(low, high, angle)
    farthest = [(-float(one), float(other)) for one, other in zip(low, high, strict=True)]  # from 0, across x and y
    sides = [[share * one, share * other] for one, other in farthest]
    (x, more_x), (y, more_y) = farthest
    edges = ((c, -s), more_x), ((-c, s), x), ((s, c), more_y), ((-s, -c), y)  # n · r ≤ d in turned axes
    for axis in (0, 1):
        lower, upper = sides[1 - axis]
        for side, sign in ((0, -1.0), (1, 1.0)):
            room = farthest[axis][side]
            for normal, distance in edges:
                outward, across = sign * normal[axis], normal[1 - axis]
                if outward > 1e-9:
                    room = min(room, (distance - max(-across * lower, across * upper)) / outward)
            sides[axis][side] = max(sides[axis][side], room)
    return np.array([-sides[0][0], -sides[1][0]]), np.array([sides[0][1], sides[1][1]])
