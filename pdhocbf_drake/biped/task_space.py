"""The eighteen task coordinates of the robot: values, Jacobian J(q) and bias J̇v, from Drake's kinematics."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RollPitchYaw, RotationMatrix
from pydrake.multibody.tree import JacobianWrtVariable

from pdhocbf_drake.biped.linear_algebra import factorize, moved_along, substitute
from pdhocbf_drake.biped.posture import Posture
from pdhocbf_drake.jit import compiled

if TYPE_CHECKING:
    from pdhocbf_drake.biped.robot import Biped

_ORIGIN = np.zeros(3)
_TORSO_ROWS = np.arange(3, 6)
_SOLES = (6, 12)  # first rows of the left and right sole: how they move; how they turn is three rows on
_TURNS = (slice(3, 6), slice(9, 12), slice(15, 18))
_SMALL_TURN = 2.99  # trace of a rotation matrix, 1 + 2 cos: above it the sine of the angle stands for the angle


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
        self._base, self._mass = biped.base_v_index, biped.mass
        base = biped.plant.GetBodyByName(biped.config.base_link)
        # A torso that is one piece with the floating base turns as v says, whatever the posture.
        self._torso_is_base = biped.torso_frame.body().index() in [
            body.index() for body in biped.plant.GetBodiesWeldedTo(base)
        ]
        self._key = self._velocity_key = b""
        # CoM (3), then rotation and place (3 x 4) of torso, left and right sole, at the last q.
        self._places = np.empty(39)
        self._com, self._poses = self._places[:3], self._places[3:].reshape(3, 3, 4)
        self._placed = False
        self._error = np.empty(21)
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
        return moved_along(q, self._plant.MapVelocityToQDot(self.context, step), self._quaternion)

    def posture(self) -> Posture:
        """Where CoM, soles and torso are."""
        poses = [frame.CalcPoseInWorld(self.context) for frame in (*self._soles, self._torso)]
        rpy = [RollPitchYaw(pose.rotation()).vector() for pose in poses]
        left, right = (np.concatenate([poses[i].translation(), rpy[i]]) for i in range(2))
        return Posture(self._plant.CalcCenterOfMassPositionInWorld(self.context), left, right, rpy[2])

    def sole_positions(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres of the left and the right sole in the world (3,) [m]."""
        poses = self.places()[3:].reshape(3, 3, 4).copy()
        return poses[1, :, 3], poses[2, :, 3]

    def error(self, target: TargetPoses) -> np.ndarray:
        """(18,) small motion [m, rad] in task coordinates that leads from here to the target.

        Below 0.1 rad the sine stands for the angle, which is equal to third order: enough for Newton's method.
        """
        error = self._error
        if not write_error(target.map, target.offset, self.places(), error):
            for i in np.flatnonzero(error[18:] < _SMALL_TURN):
                error[_TURNS[i]] = _rotation_vector(target.rotations[i], self._poses[i, :, :3])
        return error[:18].copy()

    def places(self) -> np.ndarray:
        """CoM (3), then rotation and origin (3 x 4) of torso, left and right sole; the next call overwrites them."""
        if not self._placed:
            context, poses = self.context, self._poses
            self._com[:] = self._plant.CalcCenterOfMassPositionInWorld(context)
            poses[0] = self._torso.CalcPoseInWorld(context).GetAsMatrix34()
            poses[1] = self._soles[0].CalcPoseInWorld(context).GetAsMatrix34()
            poses[2] = self._soles[1].CalcPoseInWorld(context).GetAsMatrix34()
            self._placed = True
        return self._places

    def jacobian(self) -> np.ndarray:
        """J(q) (18, 18); do not write into it."""
        if self._jacobian is None:
            plant, context, world, kind = self._plant, self.context, self._world, JacobianWrtVariable.kV
            jacobian = np.zeros((18, 18))
            jacobian[0:3] = plant.CalcJacobianCenterOfMassTranslationalVelocity(context, kind, world, world)
            if self._torso_is_base:
                jacobian[_TORSO_ROWS, self._base[:3]] = 1.0
            else:
                jacobian[3:6] = plant.CalcJacobianSpatialVelocity(context, kind, self._torso, _ORIGIN, world, world)[:3]
            for row, frame in zip(_SOLES, self._soles, strict=True):
                sole = plant.CalcJacobianSpatialVelocity(context, kind, frame, _ORIGIN, world, world)
                jacobian[row : row + 3], jacobian[row + 3 : row + 6] = sole[3:], sole[:3]  # Drake has turns first
            self._jacobian = jacobian
        return self._jacobian

    def solved(self, wanted: np.ndarray) -> np.ndarray | None:
        """J(q)⁻¹ wanted (18,), with one factorization for each q; None where J is singular."""
        if self._factorized is None:
            self._factors[:] = self.jacobian()
            self._factorized = factorize(self._factors, self._pivots)
        return substitute(self._factors, self._pivots, wanted) if self._factorized else None

    def bias(self) -> np.ndarray:
        """J̇(q, v) v (18,) [m/s², rad/s²]."""
        plant, context, world, kind = self._plant, self.context, self._world, JacobianWrtVariable.kV
        bias = np.zeros(18)
        # With v̇ = 0 the force on the base is the whole robot's mass times its CoM's acceleration.
        bias[0:3] = plant.CalcBiasTerm(context)[self._base[3:]] / self._mass
        if not self._torso_is_base:
            acceleration = plant.CalcBiasSpatialAcceleration(context, kind, self._torso, _ORIGIN, world, world)
            bias[3:6] = acceleration.rotational()
        for row, frame in zip(_SOLES, self._soles, strict=True):
            sole = plant.CalcBiasSpatialAcceleration(context, kind, frame, _ORIGIN, world, world).get_coeffs()
            bias[row : row + 3], bias[row + 3 : row + 6] = sole[3:], sole[:3]
        return bias


class TargetPoses:
    """A `Posture` with its rotations as matrices, and the task error as an affine map of where the robot is.

    For rotations T of the target and R of the robot the error ½ (T Rᵀ − R Tᵀ)ᵛ is linear in R, and so is trace(T Rᵀ),
    which tells whether that is a small turn.

    Attributes:
        rotations: of torso, left and right sole (3, 3, 3).
        map, offset: [CoM, torso, left, right: (18,) error; three traces] = offset + map · `TaskSpace` places,
            shapes (21, 39) and (21,).
    """

    def __init__(self, target: Posture) -> None:
        angles = np.concatenate([target.torso_rpy, target.left[3:], target.right[3:]])
        self.rotations, self.map = _error_map(*angles.tolist())
        self.offset = np.zeros(21)
        self.offset[0:3], self.offset[6:9], self.offset[12:15] = target.com, target.left[:3], target.right[:3]


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


@compiled
def write_error(rows: np.ndarray, offset: np.ndarray, places: np.ndarray, out: np.ndarray) -> bool:
    """offset + rows · places; whether all three turns are small."""
    for i in range(len(offset)):
        total = offset[i]
        for j in range(len(places)):
            total += rows[i, j] * places[j]
        out[i] = total
    return out[18] >= _SMALL_TURN and out[19] >= _SMALL_TURN and out[20] >= _SMALL_TURN
