"""The eighteen task coordinates of the robot: values, Jacobian J(q) and bias J̇v, from Drake's kinematics."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RollPitchYaw, RotationMatrix
from pydrake.multibody.tree import JacobianWrtVariable

from pdhocbf_drake.robot.linear_algebra import factorize, move_along, substitute
from pdhocbf_drake.robot.posture import UPRIGHT, Posture
from pdhocbf_drake.robot.task_arrays import write_bias, write_error, write_jacobian, write_places

if TYPE_CHECKING:
    from pdhocbf_drake.robot.robot import Biped

_ORIGIN = np.zeros(3)
_REST = np.zeros(6)
_TURNS = (slice(3, 6), slice(9, 12), slice(15, 18))


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
        self._left, self._right = biped.soles["left"].frame, biped.soles["right"].frame
        self._quaternion = biped.base_q_index[:4]
        self._base, self._mass = biped.base_v_index, biped.mass
        base = biped.plant.GetBodyByName(biped.config.base_link)
        # A torso that is one piece with the floating base turns as v says, whatever the posture.
        welded = [body.index() for body in biped.plant.GetBodiesWeldedTo(base)]
        self._torso_is_base = biped.torso_frame.body().index() in welded
        self._turning_base = np.zeros((6, 18), order="F")
        self._turning_base[np.arange(3), self._base[:3]] = 1.0
        self._key = self._velocity_key = b""
        # CoM (3), then rotation and place (3 x 4) of torso, left and right sole, at the last q.
        self._places = np.empty(39)
        self._placed = False
        self._jacobian: np.ndarray | None = None
        self._factors, self._pivots = np.empty((18, 18)), np.empty(18, dtype=np.int64)
        self._factorized: bool | None = None

    def set_positions(self, q: np.ndarray) -> None:
        """Moves to q (19,)."""
        key = q.tobytes()
        if key != self._key:
            self._plant.SetPositions(self.context, q)
            self._key = key
            self._placed, self._jacobian, self._factorized = False, None, None

    def set_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Moves to q (19,) with generalized velocity v (18,)."""
        self.set_positions(q)
        key = v.tobytes()
        if key != self._velocity_key:
            self._plant.SetVelocities(self.context, v)
            self._velocity_key = key

    def moved(self, q: np.ndarray, step: np.ndarray) -> np.ndarray:
        """q ⊕ step (18,): along q̇ = N(q) v, quaternion normalized; the task space stays at q."""
        self.set_positions(q)
        moved = np.empty(len(q))
        move_along(q, self._plant.MapVelocityToQDot(self.context, step), self._quaternion, moved)
        return moved

    def posture(self) -> Posture:
        """Where CoM, soles and torso are."""
        poses = [frame.CalcPoseInWorld(self.context) for frame in (self._left, self._right, self._torso)]
        rpy = [RollPitchYaw(pose.rotation()).vector() for pose in poses]
        left, right = (np.concatenate([poses[i].translation(), rpy[i]]) for i in range(2))
        return Posture(self._plant.CalcCenterOfMassPositionInWorld(self.context), left, right, rpy[2])

    def sole_positions(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres of the left and the right sole in the world (3,) [m]."""
        poses = self.places()[3:].reshape(3, 3, 4).copy()
        return poses[1, :, 3], poses[2, :, 3]

    def error(self, target: TargetPoses) -> np.ndarray:
        """(18,) small motion [m, rad] in task coordinates that leads from here to the target.

        Where all turns are below 0.1 rad the sine stands for the angle, which is equal to third order: enough for
        Newton's method.
        """
        error, places = np.empty(18), self.places()
        if not write_error(target.map, target.offset, places, error):
            for turn, rotation, pose in zip(_TURNS, target.rotations, places[3:].reshape(3, 3, 4), strict=True):
                error[turn] = _rotation_vector(rotation, pose[:, :3])
        return error

    def places(self) -> np.ndarray:
        """CoM (3), then rotation and origin (3 x 4) of torso, left and right sole; the next call overwrites them."""
        if not self._placed:
            com = self._plant.CalcCenterOfMassPositionInWorld(self.context)
            torso = self._torso.CalcPoseInWorld(self.context).GetAsMatrix34()
            left = self._left.CalcPoseInWorld(self.context).GetAsMatrix34()
            right = self._right.CalcPoseInWorld(self.context).GetAsMatrix34()
            write_places(com, torso, left, right, self._places)
            self._placed = True
        return self._places

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

    def solved(self, wanted: np.ndarray) -> np.ndarray | None:
        """J(q)⁻¹ wanted (18,), with one factorization for each q; None where J is singular."""
        if self._factorized is None:
            self.jacobian()
            self._factorized = factorize(self._factors, self._pivots)
        if not self._factorized:
            return None
        solution = np.empty(18)
        substitute(self._factors, self._pivots, wanted, solution)
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


class TargetPoses:
    """A `Posture` with its rotations as matrices, and the task error as an affine map of where the robot is.

    For rotations T of the target and R of the robot the error ½ (T Rᵀ − R Tᵀ)ᵛ is linear in R, and so is trace(T Rᵀ),
    which tells whether that is a small turn.

    Attributes:
        rotations: of torso, left and right sole (3, 3, 3).
        map: (21, 39), offset: (18,): [CoM, torso, left, right: (18,) error; three traces] = [offset; 0] + map ·
            `TaskSpace` places.
    """

    def __init__(self, offset: np.ndarray, *angles: float) -> None:
        """
        Args:
            offset: places of the CoM, of nothing, of the left sole, of nothing, of the right sole, of nothing, (18,).
            angles: roll, pitch and yaw of torso, left and right sole [rad].
        """
        self.offset = offset
        self.rotations, self.map = _error_map(*angles)

    @classmethod
    def of(cls, target: Posture) -> TargetPoses:
        """What a posture asks for."""
        rotations = np.concatenate([target.torso_rpy, target.left[3:], target.right[3:]])
        places = [target.com, UPRIGHT, target.left[:3], UPRIGHT, target.right[:3], UPRIGHT]
        return cls(np.concatenate(places), *rotations.tolist())


@lru_cache(maxsize=64)  # most ticks of a walk ask for the same few orientations
def _error_map(*angles: float) -> tuple[np.ndarray, np.ndarray]:
    """For the roll, pitch and yaw of torso, left and right sole: see `TargetPoses`."""
    rotations = np.array([RotationMatrix(RollPitchYaw(*angles[i : i + 3])).matrix() for i in (0, 3, 6)])
    rows = np.zeros((21, 39))
    rows[0:3, 0:3] = -np.eye(3)
    for i, rotation in enumerate(rotations):
        block = rows[:, 3 + 12 * i : 15 + 12 * i].reshape(21, 3, 4)
        for axis, (up, down) in enumerate(((2, 1), (0, 2), (1, 0))):
            block[_TURNS[i].start + axis, down, :3] = 0.5 * rotation[up]
            block[_TURNS[i].start + axis, up, :3] = -0.5 * rotation[down]
        if i > 0:
            block[_TURNS[i].start - 3 : _TURNS[i].start, :, 3] = -np.eye(3)
        block[18 + i, :, :3] = rotation
        rows[:, 3 + 12 * i : 15 + 12 * i] = block.reshape(21, 12)
    return rotations, rows


def _rotation_vector(target: np.ndarray, present: np.ndarray) -> np.ndarray:
    """Rotation vector [rad], in the world, that turns the present rotation matrix into its target, however far."""
    turn = RotationMatrix.ProjectToRotationMatrix(target @ present.T).ToAngleAxis()
    vector: np.ndarray = turn.axis() * turn.angle()
    return vector
