"""The eighteen task coordinates of the robot: values, Jacobian J(q) and bias J̇v, from Drake's kinematics."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RollPitchYaw, RotationMatrix
from pydrake.multibody.tree import JacobianWrtVariable

from pdhocbf_drake.biped.posture import Posture

if TYPE_CHECKING:
    from pdhocbf_drake.biped.robot import Biped

_LINEAR_FIRST = [3, 4, 5, 0, 1, 2]  # Drake puts the angular rows of a spatial vector first
_ORIGIN = np.zeros(3)
_UP, _DOWN = [2, 0, 1], [1, 2, 0]  # the entries of a skew matrix that hold +a and -a


class TaskSpace:
    """Task velocity of the floating robot, linear in the generalized velocity:

        [v_com; ω_torso; v_left; ω_left; v_right; ω_right] = J(q) v,     its derivative = J(q) v̇ + J̇(q, v) v.

    J is square (18 x 18) for two six-joint legs. It is kept for the last q, so that inverse kinematics,
    velocity maps and feedforward at one and the same q evaluate it once.

    Attributes:
        context: the plant's context that holds the present q and v.
    """

    def __init__(self, biped: Biped) -> None:
        self._plant = biped.plant
        self.context = biped.plant.CreateDefaultContext()
        self._world = biped.plant.world_frame()
        self._torso = biped.torso_frame
        self._soles = (biped.soles["left"].frame, biped.soles["right"].frame)
        self._quaternion = biped.base_q_index[:4]
        self._q = b""
        self._jacobian: np.ndarray | None = None

    def set_positions(self, q: np.ndarray) -> None:
        """Moves to q (19,)."""
        key = q.tobytes()
        if key != self._q:
            self._plant.SetPositions(self.context, q)
            self._q = key
            self._jacobian = None

    def set_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Moves to q (19,) with generalized velocity v (18,)."""
        self.set_positions(q)
        self._plant.SetVelocities(self.context, v)

    def moved(self, q: np.ndarray, step: np.ndarray) -> np.ndarray:
        """q ⊕ step (18,): along q̇ = N(q) v, quaternion normalized; the task space stays at q."""
        self.set_positions(q)
        moved: np.ndarray = q + self._plant.MapVelocityToQDot(self.context, step)
        moved[self._quaternion] /= np.linalg.norm(moved[self._quaternion])
        return moved

    def posture(self) -> Posture:
        """Where CoM, soles and torso are."""
        poses = [frame.CalcPoseInWorld(self.context) for frame in (*self._soles, self._torso)]
        rpy = [RollPitchYaw(pose.rotation()).vector() for pose in poses]
        left, right = (np.concatenate([poses[i].translation(), rpy[i]]) for i in range(2))
        return Posture(self._plant.CalcCenterOfMassPositionInWorld(self.context), left, right, rpy[2])

    def sole_positions(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres of the left and the right sole in the world (3,) [m]."""
        left, right = (frame.CalcPoseInWorld(self.context).translation() for frame in self._soles)
        return left, right

    def error(self, target: TargetPoses) -> np.ndarray:
        """(18,) small motion [m, rad] in task coordinates that leads from here to the target."""
        torso = self._torso.CalcPoseInWorld(self.context)
        left, right = (frame.CalcPoseInWorld(self.context) for frame in self._soles)
        rotations = np.array([pose.rotation().matrix() for pose in (torso, left, right)])
        turns = rotation_vectors(target.rotations, rotations)
        error = np.empty(18)
        error[0:3] = target.com - self._plant.CalcCenterOfMassPositionInWorld(self.context)
        error[3:6] = turns[0]
        error[6:9] = target.left - left.translation()
        error[9:12] = turns[1]
        error[12:15] = target.right - right.translation()
        error[15:18] = turns[2]
        return error

    def jacobian(self) -> np.ndarray:
        """J(q) (18, 18); do not write into it."""
        if self._jacobian is None:
            plant, context, world, kind = self._plant, self.context, self._world, JacobianWrtVariable.kV
            jacobian = np.empty((18, 18))
            jacobian[0:3] = plant.CalcJacobianCenterOfMassTranslationalVelocity(context, kind, world, world)
            torso, left, right = (
                plant.CalcJacobianSpatialVelocity(context, kind, frame, _ORIGIN, world, world)
                for frame in (self._torso, *self._soles)
            )
            jacobian[3:6] = torso[:3]
            jacobian[6:12] = left[_LINEAR_FIRST]
            jacobian[12:18] = right[_LINEAR_FIRST]
            self._jacobian = jacobian
        return self._jacobian

    def bias(self) -> np.ndarray:
        """J̇(q, v) v (18,) [m/s², rad/s²]."""
        plant, context, world, kind = self._plant, self.context, self._world, JacobianWrtVariable.kV
        com = plant.CalcBiasCenterOfMassTranslationalAcceleration(context, kind, world, world)
        torso, left, right = (
            plant.CalcBiasSpatialAcceleration(context, kind, frame, _ORIGIN, world, world)
            for frame in (self._torso, *self._soles)
        )
        soles = (part for sole in (left, right) for part in (sole.translational(), sole.rotational()))
        return np.concatenate([com, torso.rotational(), *soles])


class TargetPoses:
    """A `Posture` with its rotations as matrices (3, 3, 3): torso, left sole, right sole."""

    def __init__(self, target: Posture) -> None:
        self.com, self.left, self.right = target.com, target.left[:3], target.right[:3]
        angles = (target.torso_rpy, target.left[3:], target.right[3:])
        self.rotations = np.array([_matrix(*rpy.tolist()) for rpy in angles])


def rotation_vectors(targets: np.ndarray, presents: np.ndarray) -> np.ndarray:
    """(n, 3) rotation vectors [rad], in the world, that turn each present rotation matrix (n, 3, 3) into its target.

    Below 0.1 rad the sine stands for the angle, which is equal to third order: enough for Newton's method.
    """
    turns = targets @ presents.transpose(0, 2, 1)
    vectors: np.ndarray = 0.5 * (turns[:, _UP, _DOWN] - turns[:, _DOWN, _UP])
    for i in np.flatnonzero(turns[:, 0, 0] + turns[:, 1, 1] + turns[:, 2, 2] < 2.99):
        turn = RotationMatrix.ProjectToRotationMatrix(turns[i]).ToAngleAxis()
        vectors[i] = turn.axis() * turn.angle()
    return vectors


@lru_cache(maxsize=64)  # most ticks of a walk ask for the same few orientations
def _matrix(roll: float, pitch: float, yaw: float) -> np.ndarray:
    matrix: np.ndarray = RotationMatrix(RollPitchYaw(roll, pitch, yaw)).matrix()
    return matrix
