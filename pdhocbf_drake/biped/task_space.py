"""The eighteen task coordinates of the robot: values, Jacobian J(q) and bias J̇v, from Drake's kinematics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RollPitchYaw, RotationMatrix
from pydrake.multibody.tree import JacobianWrtVariable

from pdhocbf_drake.biped.posture import Posture

if TYPE_CHECKING:
    from pdhocbf_drake.biped.robot import Biped

_LINEAR_FIRST = [3, 4, 5, 0, 1, 2]  # Drake puts the angular rows of a spatial vector first


class TaskSpace:
    """Task velocity of the floating robot, linear in the generalized velocity:

        [v_com; ω_torso; v_left; ω_left; v_right; ω_right] = J(q) v,     its derivative = J(q) v̇ + J̇(q, v) v.

    J is square (18 x 18) for two six-joint legs. Results of the last q are kept, so that inverse
    kinematics, velocity maps and feedforward at one and the same q evaluate them once.

    Attributes:
        context: the plant's context that holds the present q and v.
    """

    def __init__(self, biped: Biped) -> None:
        self._plant = biped.plant
        self.context = biped.plant.CreateDefaultContext()
        self._world = biped.plant.world_frame()
        self._torso = biped.torso_frame
        self._soles = (biped.soles["left"].frame, biped.soles["right"].frame)
        self._q = np.full(biped.plant.num_positions(), np.nan)
        self._jacobian: np.ndarray | None = None

    def set_positions(self, q: np.ndarray) -> None:
        """Moves to q (19,)."""
        if not np.array_equal(q, self._q):
            self._plant.SetPositions(self.context, q)
            self._q = np.array(q)
            self._jacobian = None

    def set_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Moves to q (19,) with generalized velocity v (18,)."""
        self.set_positions(q)
        self._plant.SetVelocities(self.context, v)

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
        error = np.empty(18)
        error[0:3] = target.com - self._plant.CalcCenterOfMassPositionInWorld(self.context)
        error[3:6] = rotation_vector(target.torso, self._torso.CalcPoseInWorld(self.context).rotation().matrix())
        for row, frame, (position, rotation) in zip((6, 12), self._soles, target.soles, strict=True):
            pose = frame.CalcPoseInWorld(self.context)
            error[row : row + 3] = position - pose.translation()
            error[row + 3 : row + 6] = rotation_vector(rotation, pose.rotation().matrix())
        return error

    def jacobian(self) -> np.ndarray:
        """J(q) (18, 18); do not write into it."""
        if self._jacobian is None:
            plant, context, world = self._plant, self.context, self._world
            jacobian = np.empty((18, plant.num_velocities()))
            jacobian[0:3] = plant.CalcJacobianCenterOfMassTranslationalVelocity(
                context, JacobianWrtVariable.kV, world, world
            )
            for rows, frame in ((slice(0, 6), self._torso), (slice(6, 12), self._soles[0]), (slice(12, 18), self._soles[1])):
                spatial = plant.CalcJacobianSpatialVelocity(
                    context, JacobianWrtVariable.kV, frame, np.zeros(3), world, world
                )
                if frame is self._torso:
                    jacobian[3:6] = spatial[:3]
                else:
                    jacobian[rows] = spatial[_LINEAR_FIRST]
            self._jacobian = jacobian
        return self._jacobian

    def bias(self) -> np.ndarray:
        """J̇(q, v) v (18,) [m/s², rad/s²]."""
        plant, context, world = self._plant, self.context, self._world
        bias = np.empty(18)
        bias[0:3] = plant.CalcBiasCenterOfMassTranslationalAcceleration(context, JacobianWrtVariable.kV, world, world)
        for row, frame in ((3, self._torso), (6, self._soles[0]), (12, self._soles[1])):
            spatial = plant.CalcBiasSpatialAcceleration(
                context, JacobianWrtVariable.kV, frame, np.zeros(3), world, world
            )
            if frame is self._torso:
                bias[3:6] = spatial.rotational()
            else:
                bias[row : row + 3] = spatial.translational()
                bias[row + 3 : row + 6] = spatial.rotational()
        return bias


class TargetPoses:
    """A `Posture` with its rotations as matrices, made once per solve."""

    def __init__(self, target: Posture) -> None:
        self.com = target.com
        self.torso = _matrix(target.torso_rpy)
        self.soles = tuple((pose[:3], _matrix(pose[3:])) for pose in (target.left, target.right))


def rotation_vector(target: np.ndarray, present: np.ndarray) -> np.ndarray:
    """Rotation vector (3,) [rad], in the world, that turns the present rotation matrix into the target's."""
    turn = target @ present.T
    axis_sine = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    if turn[0, 0] + turn[1, 1] + turn[2, 2] > 2.99:  # under 0.1 rad: angle = sine + sine³/6 to 1e-7
        return axis_sine * (1.0 + axis_sine @ axis_sine / 6.0)
    turned = RotationMatrix.ProjectToRotationMatrix(turn).ToAngleAxis()
    return turned.axis() * turned.angle()


def _matrix(rpy: np.ndarray) -> np.ndarray:
    matrix: np.ndarray = RotationMatrix(RollPitchYaw(rpy)).matrix()
    return matrix
