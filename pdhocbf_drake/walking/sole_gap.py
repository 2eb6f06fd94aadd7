"""How far apart two soles are, seen from above."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np


class Pose(NamedTuple):
    """A place on the ground [m] and a heading [rad]."""

    x: float
    y: float
    yaw: float

    def moved(self, ahead: float, aside: float, turn: float = 0.0) -> Pose:
        """The pose that is so far ahead and to the left of this one, as this one faces [m], and turned [rad]."""
        if not self.yaw:
            return Pose(self.x + ahead, self.y + aside, turn)
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(self.x + c * ahead - s * aside, self.y + s * ahead + c * aside, self.yaw + turn)


def sole_gap(one: Pose, other: Pose, half: tuple[float, float]) -> float:
    """Distance of two rectangles with half sides `half`, along the side of either that separates them best [m].

    Negative where they overlap, by how much. Where two corners are nearest the true distance is longer.
    """
    (a, b), turn = half, other.yaw - one.yaw
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    reach = a * (1.0 + c) + b * s, b * (1.0 + c) + a * s
    gaps = []
    for pose in (one, other):
        cos, sin, x, y = math.cos(pose.yaw), math.sin(pose.yaw), other.x - one.x, other.y - one.y
        gaps += [abs(cos * x + sin * y) - reach[0], abs(cos * y - sin * x) - reach[1]]
    return max(gaps)


def sole_gaps(one: np.ndarray, other: np.ndarray, half: np.ndarray) -> np.ndarray:
    """`sole_gap` of poses x, y, yaw at many instants, shapes (T, 3); (T,) [m]."""
    (a, b), apart = half, (other - one)[:, :2]
    turn = other[:, 2] - one[:, 2]
    c, s = np.abs(np.cos(turn)), np.abs(np.sin(turn))
    gaps = []
    for yaw in (one[:, 2], other[:, 2]):
        ahead = np.cos(yaw) * apart[:, 0] + np.sin(yaw) * apart[:, 1]
        aside = np.cos(yaw) * apart[:, 1] - np.sin(yaw) * apart[:, 0]
        gaps += [np.abs(ahead) - a * (1.0 + c) - b * s, np.abs(aside) - b * (1.0 + c) - a * s]
    return np.asarray(np.max(gaps, axis=0))
