"""Whole-body inverse kinematics: a square Newton iteration with a damped fallback that respects joint limits."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.config import Side
from pdhocbf_drake.robot.damped import nearest_posture, row_weights
from pdhocbf_drake.robot.multibody.kernels import largest, limit
from pdhocbf_drake.robot.posture import Posture, TargetPoses
from pdhocbf_drake.robot.task_space import FARTHEST, LARGEST_RATE, TOLERANCE
from pdhocbf_drake.robot.tree_task_space import task_space_of

LEVEL = (0.0,) * 9
"""An upright torso and level soles that face ahead: roll, pitch and yaw of torso, left and right sole [rad]."""

_STRETCHED_DAMPING = 0.1
_REFUSED = f"the target is not finite, or beyond {FARTHEST:g} m"
_PARTS = ("CoM", "torso rotation", "left sole", "left sole rotation", "right sole", "right sole rotation")
_ROWS = tuple(f"{part} {axis}" for part in _PARTS for axis in "xyz")


class IkResult(NamedTuple):
    """A posture that meets the target, or the nearest one within the joint limits.

    Attributes:
        q: positions (19,), always finite and within the joint limits.
        ok: whether the target is met to `TOLERANCE`.
        iterations: Newton and fallback iterations.
        error: greatest entry of the task error [m, rad].
        reason: why it is not ok, else empty.
    """

    q: np.ndarray
    ok: bool
    iterations: int
    error: float
    reason: str


class Motion(NamedTuple):
    """Positions q (19,), velocities v (18,), accelerations vdot (18,), and the result of the inverse kinematics."""

    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray
    ik: IkResult


class WholeBodyIk:
    """Finds q such that CoM, torso rotation and both soles are at their targets.

    Eighteen equations x(q) = x* in eighteen unknowns:  q ← q ⊕ J(q)⁻¹ (x* ⊖ x(q)),  quadratically convergent
    from the last tick's solution. Where J is near singular (straight knee) or a joint limit is in the way,
    `damped.nearest_posture` takes over.
    Nothing here raises: a target out of reach gives `ok = False`, a reason and the nearest q.

    Attributes:
        task_space: kinematics at the last q, to be shared with `InverseDynamics`.
    """

    def __init__(self, biped: Biped) -> None:
        self._biped = biped
        self.task_space = task_space_of(biped)
        self._quaternion = biped.base_q_index[:4]
        self._q_index, self._v_index, self._speed_limits = biped.q_index, biped.v_index, biped.velocity_limits
        self._lower, self._upper = np.ascontiguousarray(biped.position_limits.T)

    def solve(self, target: Posture, seed: np.ndarray, loose: Side | None = None) -> IkResult:
        """The posture nearest to `seed` (19,) that meets the target.

        Where no posture meets it, a `loose` foot, one that carries no load, is the first to miss its own target.
        """
        if not math.isfinite(np.concatenate(target).sum()):
            return self._refused(seed, _REFUSED)
        return self._solve(TargetPoses.of(target), seed, loose, float(target.torso_rpy[2]))

    def solve_poses(self, goal: TargetPoses, seed: np.ndarray, loose: Side | None = None) -> IkResult:
        """As `solve`, for a finite target with a torso that faces ahead."""
        return self._solve(goal, seed, loose, 0.0)

    def motion(
        self, wanted: np.ndarray, seed: np.ndarray, loose: Side | None = None, angles: tuple[float, ...] = LEVEL
    ) -> Motion:
        """Positions, velocities and accelerations of one tick, with one Jacobian at the solution, factorized once.

        Args:
            wanted: places (zeros for the rotations), velocities and accelerations in task coordinates, see
                `posture.COM` and those after it, (3, 18) [m, rad, s].
            seed, loose: as in `solve`.
            angles: roll, pitch and yaw of torso, left and right sole, finite [rad].
        """
        found = self._solve(TargetPoses(wanted[0], *angles), seed, loose, angles[2])
        weights = None if found.ok else row_weights(loose, angles[2])
        v, vdot = self.derivatives(found.q, wanted[1], wanted[2], weights)
        return Motion(found.q, v, vdot, found)

    def derivatives(
        self, q: np.ndarray, rates: np.ndarray, accelerations: np.ndarray, weights: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """v and v̇ (18,) with J v = rates and J v̇ + J̇v = accelerations, both (18,), at q (19,).

        Joint speeds stay within their limits. With `weights` (18, 18), see `damped.row_weights`, both are damped and
        weighted least squares: for a posture that misses its target, whose legs are stretched.
        """
        task = self.task_space
        followed = task.follow(q, rates, accelerations) if weights is None else None
        if followed is not None:
            return followed
        task.set_positions(q)
        v = self._velocity(rates, weights)
        limit(v, self._v_index, self._speed_limits)
        task.set_state(q, v)
        return v, self._velocity(accelerations - task.bias(), weights)

    def _solve(self, goal: TargetPoses, seed: np.ndarray, loose: Side | None, yaw: float) -> IkResult:
        if not largest(goal.offset) < FARTHEST:
            return self._refused(seed, _REFUSED)
        task = self.task_space
        good = task.within(seed) and largest(seed) < FARTHEST
        q, steps, worst = task.approach(goal, seed if good else self._biped.clipped(self._start(seed)))
        return IkResult(q, True, steps, worst, "") if worst < TOLERANCE else self._damped(goal, q, steps, loose, yaw)

    def _velocity(self, wanted: np.ndarray, weights: np.ndarray | None) -> np.ndarray:
        """J⁻¹ wanted (18,); damped least squares where that exceeds `LARGEST_RATE`, or weights are given."""
        if weights is None:
            solution = self.task_space.solve(wanted)
            if solution is not None and largest(solution) < LARGEST_RATE:
                return solution
        jacobian = self.task_space.jacobian()
        if weights is not None:
            weighted = weights @ jacobian
            normal = weighted.T @ weighted + _STRETCHED_DAMPING * np.eye(len(wanted))
            return np.linalg.solve(normal, weighted.T @ (weights @ np.nan_to_num(wanted)))
        wanted = np.nan_to_num(wanted, nan=0.0, posinf=0.0, neginf=0.0)
        return np.linalg.solve(jacobian.T @ jacobian + 1e-3 * np.eye(len(wanted)), jacobian.T @ wanted)

    def _damped(self, goal: TargetPoses, q: np.ndarray, iterations: int, loose: Side | None, yaw: float) -> IkResult:
        q, error, more = nearest_posture(self._biped, self.task_space, goal, q, row_weights(loose, yaw))
        worst = float(abs(error).max())
        reason = "" if worst < TOLERANCE else self._reason(q, error)
        return IkResult(q, not reason, iterations + more, worst, reason)

    def _reason(self, q: np.ndarray, error: np.ndarray) -> str:
        row = int(abs(error).argmax())
        unit = "rad" if "rotation" in _ROWS[row] else "m"
        joints = q[self._q_index]
        at_limit = (joints <= self._lower + 1e-6) | (joints >= self._upper - 1e-6)
        names = [name for name, is_at in zip(self._biped.joint_names, at_limit, strict=True) if is_at]
        held = f" with {', '.join(names)} at the limit" if names else ""
        return f"{_ROWS[row]} misses by {abs(error[row]):.2g} {unit}{held}"

    def _start(self, seed: np.ndarray) -> np.ndarray:
        """The seed, or the bent-knee posture where the seed is not finite or has no orientation."""
        oriented = largest(seed[self._quaternion]) > 0.0
        return seed if oriented and largest(seed) < FARTHEST else self._biped.bent_knee

    def _refused(self, seed: np.ndarray, reason: str) -> IkResult:
        q = self._biped.clipped(self._start(seed))
        return IkResult(q, False, 0, float("inf"), reason)
