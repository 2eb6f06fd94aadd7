"""What whole-body motion is asked for: where CoM, torso and soles are, and their first or second derivatives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

UPRIGHT = np.zeros(3)


def sole_pose(x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    """A level sole: its six numbers (xyz, rpy) in the world."""
    return np.array([x, y, z, 0.0, 0.0, yaw])


class Posture(NamedTuple):
    """Eighteen numbers that fix the eighteen coordinates of a floating robot with two six-joint legs.

    Attributes:
        com: centre of mass in the world (3,) [m].
        left: left sole in the world (6,): xyz [m], then roll-pitch-yaw [rad].
        right: right sole in the world (6,): xyz [m], then roll-pitch-yaw [rad].
        torso_rpy: torso orientation in the world (3,) [rad].
    """

    com: np.ndarray
    left: np.ndarray
    right: np.ndarray
    torso_rpy: np.ndarray = UPRIGHT


class PostureRates(NamedTuple):
    """First (or second) time derivatives of a posture, in the world.

    Attributes:
        com: CoM velocity (acceleration) (3,) [m/s, m/s²].
        left: left sole: linear velocity (3), then angular velocity (3) [m/s, rad/s], or their derivatives.
        right: the same of the right sole.
        torso: torso angular velocity (acceleration) (3,) [rad/s, rad/s²].
    """

    com: np.ndarray
    left: np.ndarray
    right: np.ndarray
    torso: np.ndarray = UPRIGHT

    def stacked(self) -> np.ndarray:
        """(18,): CoM, torso, left sole, right sole."""
        return np.concatenate([self.com, self.torso, self.left, self.right])
