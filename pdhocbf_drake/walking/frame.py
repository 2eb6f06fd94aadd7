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
