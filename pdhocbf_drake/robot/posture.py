"""Targets of whole-body motion: the places of CoM and soles, the orientation of torso and soles, and the task error."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from pydrake.math import RollPitchYaw, RotationMatrix

COM, TORSO_TURN, LEFT, LEFT_TURN, RIGHT, RIGHT_TURN = (slice(first, first + 3) for first in range(0, 18, 3))
"""Where the parts of the eighteen task coordinates stand: translation of CoM and soles, rotation of torso and soles."""

TURNS = (TORSO_TURN, LEFT_TURN, RIGHT_TURN)
UPRIGHT = np.zeros(3)


def sole_pose(x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    """A level sole in the world: xyz [m], roll-pitch-yaw [rad], shape (6,)."""
    return np.array([x, y, z, 0.0, 0.0, yaw])


class Posture(NamedTuple):
    """Eighteen numbers that fix the eighteen degrees of freedom of a floating base with two six-joint legs.

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


class TargetPoses:
    """The target of inverse kinematics, with the task error as an affine map of the robot's poses.

    With the target's rotation matrix T and the robot's R, the rotational error ½ (T Rᵀ − R Tᵀ)ᵛ is linear in R, and so
    is trace(T Rᵀ) = 1 + 2 cos(angle), which says whether the remaining turn is small.

    Attributes:
        rotations: of torso, left and right sole (3, 3, 3).
        map: (21, 39), offset: (18,): [error (18); three traces] = [offset; 0] + map · `TaskSpace.poses`.
    """

    def __init__(self, offset: np.ndarray, *angles: float) -> None:
        """
        Args:
            offset: places of CoM, left and right sole in task coordinates, with zeros for the rotations, (18,) [m].
            angles: roll, pitch and yaw of torso, left and right sole, nine numbers [rad].
        """
        self.offset = offset
        self.rotations, self.map = _error_map(*angles)

    @classmethod
    def of(cls, target: Posture) -> TargetPoses:
        """The target of a posture."""
        offset = np.zeros(18)
        offset[COM], offset[LEFT], offset[RIGHT] = target.com, target.left[:3], target.right[:3]
        return cls(offset, *np.concatenate([target.torso_rpy, target.left[3:], target.right[3:]]).tolist())


@lru_cache(maxsize=64)  # most ticks of a walk ask for the same few orientations
def _error_map(*angles: float) -> tuple[np.ndarray, np.ndarray]:
    """`rotations` and `map` of `TargetPoses`."""
    rotations = np.array([RotationMatrix(RollPitchYaw(*angles[i : i + 3])).matrix() for i in (0, 3, 6)])
    rows = np.zeros((21, 39))
    rows[COM, 0:3] = -np.eye(3)
    for i, (turn, rotation) in enumerate(zip(TURNS, rotations, strict=True)):
        block = rows[:, 3 + 12 * i : 15 + 12 * i].reshape(21, 3, 4)
        for axis, (up, down) in enumerate(((2, 1), (0, 2), (1, 0))):
            block[turn.start + axis, down, :3] = 0.5 * rotation[up]
            block[turn.start + axis, up, :3] = -0.5 * rotation[down]
        if turn is not TORSO_TURN:
            block[turn.start - 3 : turn.start, :, 3] = -np.eye(3)
        block[18 + i, :, :3] = rotation
        rows[:, 3 + 12 * i : 15 + 12 * i] = block.reshape(21, 12)
    return rotations, rows
