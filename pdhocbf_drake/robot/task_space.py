"""The eighteen task coordinates of the robot, Newton's method for them, and the motion that follows them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from pydrake.math import RotationMatrix

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.multibody.kernels import factorize, largest, limit, substitute, within_limits, write_error
from pdhocbf_drake.robot.posture import TURNS, TargetPoses

TOLERANCE = 1e-8  # greatest entry of the task error [m, rad]
NEWTON_STEPS = 12
LARGEST_STEP = 0.5  # [rad]: a larger joint step means that the Jacobian is near singular
FIRST_DAMPING = 1e-3  # of `damped.nearest_posture`
FARTHEST = 1e6  # [m, rad]: targets and seeds beyond it are refused
LARGEST_RATE = 1e3  # [rad/s, rad/s²]: a larger joint speed or acceleration is none to follow


class MovedAlong(NamedTuple):
    """q (19,), v and v̇ (18,), torques and the wrenches on both soles (24,), steps taken, largest entry of the error."""

    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray
    torque: np.ndarray
    steps: int
    worst: float


class TaskSpace(ABC):
    """Task velocity of the floating robot, linear in the generalized velocity:

        [v_com; ω_torso; v_left; ω_left; v_right; ω_right] = J(q) v,     its derivative = J(q) v̇ + J̇(q, v) v.

    J is square (18 x 18) for two six-joint legs. What is computed is kept for the last q, so that inverse kinematics,
    velocities and inverse dynamics at the same q evaluate it once.
    """

    def __init__(self, biped: Biped) -> None:
        self._joints, self._speeds = biped.v_index, biped.velocity_limits
        self._q_index, self._quaternion = biped.q_index, int(biped.base_q_index[0])
        self._lower, self._upper = np.ascontiguousarray(biped.position_limits.T)
        self._key = b""
        self._factors, self._pivots = np.empty((18, 18)), np.empty(18, dtype=np.int64)
        self._factorized: bool | None = None

    @abstractmethod
    def set_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Sets q (19,) and the generalized velocity v (18,)."""

    @abstractmethod
    def moved(self, q: np.ndarray, step: np.ndarray) -> np.ndarray:
        """q ⊕ step (18,): along q̇ = N(q) v, with the quaternion normalized."""

    @abstractmethod
    def poses(self) -> np.ndarray:
        """CoM (3), then rotation and origin, (3, 4) row by row, of torso, left and right sole; shape (39,).

        The next call overwrites the array.
        """

    def poses_and_velocity(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`poses` and `com_velocity` at q (19,) and v (18,)."""
        self.set_state(q, v)
        return self.poses(), self.com_velocity()

    @abstractmethod
    def com_velocity(self) -> np.ndarray:
        """Velocity of the CoM (3,) [m/s]."""

    @abstractmethod
    def jacobian(self) -> np.ndarray:
        """J(q) (18, 18); do not write into it, the next call overwrites it."""

    @abstractmethod
    def bias(self) -> np.ndarray:
        """J̇(q, v) v (18,) [m/s², rad/s²]."""

    @abstractmethod
    def forces(self, vdot: np.ndarray) -> np.ndarray:
        """M(q) v̇ + C(q, v) v − τ_g(q) (18,), which joints and ground have to apply, damping included [N m, N]."""

    def inertial_forces(self, accelerations: np.ndarray) -> np.ndarray:
        """M(q) a for each column a of the accelerations (18, n), reflected inertia included, (18, n) [N m, N]."""
        rest = self.forces(np.zeros(len(accelerations)))
        return np.array([self.forces(column) - rest for column in accelerations.T.copy()]).T

    @abstractmethod
    def _place(self, q: np.ndarray) -> None:
        """Sets q (19,), another one than the last."""

    def set_positions(self, q: np.ndarray) -> None:
        """Sets q (19,)."""
        key = q.tobytes()
        if key != self._key:
            self._key, self._factorized = key, None
            self._place(q)

    def within(self, q: np.ndarray) -> bool:
        """Whether every joint of q (19,) is within its limits, and its quaternion has length one."""
        return within_limits(q, self._q_index, self._lower, self._upper, self._quaternion)

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

    def solve(self, right: np.ndarray) -> np.ndarray | None:
        """J(q)⁻¹ right (18,), with one factorization for each q; None where J is singular."""
        if self._factorized is None:
            self._factors[:] = self.jacobian()
            self._factorized = factorize(self._factors, self._pivots)
        if not self._factorized:
            return None
        solution = np.empty(18)
        substitute(self._factors, self._pivots, right, solution)
        return solution

    def approach(self, goal: TargetPoses, q: np.ndarray) -> tuple[np.ndarray, int, float]:
        """Newton's method q ← q ⊕ J(q)⁻¹ (x* ⊖ x(q)) from q (19,), which is within its limits.

        It gives up where J is near singular, a joint would leave its limits, or after `NEWTON_STEPS`.

        Returns:
            The last q within the limits, steps taken, and the largest entry of its task error, infinite if it gave up.
        """
        return self._approach(goal, q.copy(), 0)

    def _approach(self, goal: TargetPoses, q: np.ndarray, first: int) -> tuple[np.ndarray, int, float]:
        """The same after the first steps have been taken."""
        for done in range(first, NEWTON_STEPS):
            self.set_positions(q)
            error = self.error(goal)
            worst = largest(error)
            if worst < TOLERANCE:
                return q, done, worst
            step = self.solve(error)
            if step is None or not largest(step) <= LARGEST_STEP:
                return q, done, np.inf
            moved = self.moved(q, step)
            if not self.within(moved):
                return q, done, np.inf
            q = moved
        return q, NEWTON_STEPS, np.inf

    def move_along(self, goal: TargetPoses, seed: np.ndarray, wanted: np.ndarray, share: float) -> MovedAlong | None:
        """`approach`, `follow` and `InverseDynamics` in one call, where there is one: here there is none.

        Args:
            goal: also the first row of `wanted`, whose others are rates and accelerations (3, 18).
            seed: q to begin with (19,). share: of the load, on the left sole.
        """
        return None

    def descend(
        self, goal: TargetPoses, q: np.ndarray, weights: np.ndarray, steps: int
    ) -> tuple[np.ndarray, int, float, bool]:
        """The first steps of `damped.nearest_posture`, as far as there is a faster way to take them: here none.

        Returns:
            q (19,), the steps taken, the damping λ, and whether it is done.
        """
        return q, 0, FIRST_DAMPING, False

    def follow(
        self, q: np.ndarray, rates: np.ndarray, accelerations: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """v and v̇ (18,) with J v = rates and J v̇ + J̇v = accelerations, both (18,), at q (19,).

        Joint speeds are clipped to their limits. None where J is singular or `LARGEST_RATE` is exceeded.
        """
        self.set_positions(q)
        v = self.solve(rates)
        if v is None or not largest(v) < LARGEST_RATE:
            return None
        limit(v, self._joints, self._speeds)
        self.set_state(q, v)
        vdot = self.solve(accelerations - self.bias())
        return None if vdot is None or not largest(vdot) < LARGEST_RATE else (v, vdot)


def _rotation_vector(target: np.ndarray, present: np.ndarray) -> np.ndarray:
    """Rotation vector [rad], in the world, that turns the present rotation matrix into its target, however far."""
    turn = RotationMatrix.ProjectToRotationMatrix(target @ present.T).ToAngleAxis()
    vector: np.ndarray = turn.axis() * turn.angle()
    return vector
