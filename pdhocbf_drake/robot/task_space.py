"""The eighteen task coordinates of the robot: poses, Jacobian J(q) and bias J̇v, from Drake's kinematics."""

from __future__ import annotations

import numpy as np
from pydrake.math import RotationMatrix
from pydrake.multibody.tree import JacobianWrtVariable

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.kernels import (
    factorize,
    move_along,
    substitute,
    write_bias,
    write_error,
    write_jacobian,
    write_poses,
)
from pdhocbf_drake.robot.posture import TURNS, TargetPoses

_ORIGIN = np.zeros(3)
_REST = np.zeros(6)


class TaskSpace:
    """Task velocity of the floating robot, linear in the generalized velocity:

        [v_com; ω_torso; v_left; ω_left; v_right; ω_right] = J(q) v,     its derivative = J(q) v̇ + J̇(q, v) v.

    J is square (18 x 18) for two six-joint legs. It is kept for the last q, so that inverse kinematics, velocities and
    inverse dynamics at the same q evaluate it once.

    Attributes:
        context: the plant's context, at the last q and v that were set.
    """

    def __init__(self, biped: Biped) -> None:
        self._plant = biped.plant
        self.context = biped.plant.CreateDefaultContext()
        self._world = biped.plant.world_frame()
        self._torso = biped.torso_frame
        self._left, self._right = biped.soles["left"].frame, biped.soles["right"].frame
        self._quaternion = biped.base_q_index[:4]
        self._base, self._mass = biped.base_v_index, biped.mass
        base = biped.plant.GetBodyByName(biped.config.base_link)
        # A torso welded to the floating base turns with the base's ω, whatever the posture.
        welded = [body.index() for body in biped.plant.GetBodiesWeldedTo(base)]
        self._torso_is_base = biped.torso_frame.body().index() in welded
        self._turning_base = np.zeros((6, 18), order="F")
        self._turning_base[np.arange(3), self._base[:3]] = 1.0
        self._key = self._velocity_key = b""
        self._poses, self._posed = np.empty(39), False
        self._jacobian: np.ndarray | None = None
        self._factors, self._pivots = np.empty((18, 18)), np.empty(18, dtype=np.int64)
        self._factorized: bool | None = None

    def set_positions(self, q: np.ndarray) -> None:
        """Sets q (19,)."""
        key = q.tobytes()
        if key != self._key:
            self._plant.SetPositions(self.context, q)
            self._key = key
            self._posed, self._jacobian, self._factorized = False, None, None

    def set_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Sets q (19,) and the generalized velocity v (18,)."""
        self.set_positions(q)
        key = v.tobytes()
        if key != self._velocity_key:
            self._plant.SetVelocities(self.context, v)
            self._velocity_key = key

    def moved(self, q: np.ndarray, step: np.ndarray) -> np.ndarray:
        """q ⊕ step (18,): along q̇ = N(q) v, with the quaternion normalized; sets q, not the result."""
        self.set_positions(q)
        moved = np.empty(len(q))
        move_along(q, self._plant.MapVelocityToQDot(self.context, step), self._quaternion, moved)
        return moved

    def error(self, target: TargetPoses) -> np.ndarray:
        """(18,) small motion [m, rad] in task coordinates that leads from here to the target.

        Where all turns are below 0.1 rad the sine stands for the angle, which is equal to third order: enough for
        Newton's method.
        """
        error, poses = np.empty(18), self.poses()
        if not write_error(target.map, target.offset, poses, error):
            for turn, rotation, pose in zip(TURNS, target.rotations, poses[3:].reshape(3, 3, 4), strict=True):
                error[turn] = _rotation_vector(rotation, pose[:, :3])
        return error

    def poses(self) -> np.ndarray:
        """CoM (3), then rotation and origin, (3, 4) row by row, of torso, left and right sole; shape (39,).

        The next call overwrites the array.
        """
        if not self._posed:
            com = self._plant.CalcCenterOfMassPositionInWorld(self.context)
            torso = self._torso.CalcPoseInWorld(self.context).GetAsMatrix34()
            left = self._left.CalcPoseInWorld(self.context).GetAsMatrix34()
            right = self._right.CalcPoseInWorld(self.context).GetAsMatrix34()
            write_poses(com, torso, left, right, self._poses)
            self._posed = True
        return self._poses

    def jacobian(self) -> np.ndarray:
        """J(q) (18, 18); do not write into it."""
        if self._jacobian is None:
            plant, context, world, kind = self._plant, self.context, self._world, JacobianWrtVariable.kV
            com = plant.CalcJacobianCenterOfMassTranslationalVelocity(context, kind, world, world)
            torso = self._turning_base
            if not self._torso_is_base:
                torso = plant.CalcJacobianSpatialVelocity(context, kind, self._torso, _ORIGIN, world, world)
            left = plant.CalcJacobianSpatialVelocity(context, kind, self._left, _ORIGIN, world, world)
            right = plant.CalcJacobianSpatialVelocity(context, kind, self._right, _ORIGIN, world, world)
            self._jacobian = np.empty((18, 18))
            write_jacobian(com, torso, left, right, self._jacobian, self._factors)
        return self._jacobian

    def solve(self, right: np.ndarray) -> np.ndarray | None:
        """J(q)⁻¹ right (18,), with one factorization for each q; None where J is singular."""
        if self._factorized is None:
            self.jacobian()
            self._factorized = factorize(self._factors, self._pivots)
        if not self._factorized:
            return None
        solution = np.empty(18)
        substitute(self._factors, self._pivots, right, solution)
        return solution

    def bias(self) -> np.ndarray:
        """J̇(q, v) v (18,) [m/s², rad/s²]."""
        plant, context, world, kind = self._plant, self.context, self._world, JacobianWrtVariable.kV
        bias, torso = np.empty(18), _REST
        if not self._torso_is_base:
            torso = plant.CalcBiasSpatialAcceleration(context, kind, self._torso, _ORIGIN, world, world).get_coeffs()
        left = plant.CalcBiasSpatialAcceleration(context, kind, self._left, _ORIGIN, world, world).get_coeffs()
        right = plant.CalcBiasSpatialAcceleration(context, kind, self._right, _ORIGIN, world, world).get_coeffs()
        write_bias(plant.CalcBiasTerm(context), self._base, self._mass, torso, left, right, bias)
        return bias


def _rotation_vector(target: np.ndarray, present: np.ndarray) -> np.ndarray:
    """Rotation vector [rad], in the world, that turns the present rotation matrix into its target, however far."""
    turn = RotationMatrix.ProjectToRotationMatrix(target @ present.T).ToAngleAxis()
    vector: np.ndarray = turn.axis() * turn.angle()
    return vector
