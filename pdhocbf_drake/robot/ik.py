"""Whole-body inverse kinematics: a square Newton iteration with a damped fallback that respects joint limits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pdhocbf_drake.robot.config import Side
from pdhocbf_drake.robot.damped import nearest_posture, row_weights
from pdhocbf_drake.robot.linear_algebra import largest, limit, within_limits
from pdhocbf_drake.robot.posture import Posture, PostureRates
from pdhocbf_drake.robot.task_space import TargetPoses, TaskSpace

if TYPE_CHECKING:
    from pdhocbf_drake.robot.robot import Biped

TOLERANCE = 1e-8  # greatest entry of the task error [m, rad]
NEWTON_ITERATIONS = 12
_STRETCHED_DAMPING = 0.1
LARGEST_STEP = 0.5  # a joint step beyond this says that the Jacobian is near singular [rad]
_LEVEL = (0.0,) * 9  # roll, pitch and yaw of torso and soles [rad]
_FARTHEST = 1e6  # [m, rad]: beyond this nothing is looked for
_NOWHERE = f"the target is not finite, or beyond {_FARTHEST:g} m"
_WILD = 1e3  # a joint speed or acceleration beyond this is no robot's [rad/s, rad/s²]
_ROWS = tuple(
    f"{what} {axis}"
    for what, axes in (
        ("CoM", "xyz"),
        ("torso rotation", "xyz"),
        ("left sole", "xyz"),
        ("left sole rotation", "xyz"),
        ("right sole", "xyz"),
        ("right sole rotation", "xyz"),
    )
    for axis in axes
)


class IkResult(NamedTuple):
    """A posture found, or the nearest one within the joint limits.

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
    """Positions q (19,), velocities v (18,), accelerations vdot (18,), and how the positions were found."""

    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray
    ik: IkResult


class WholeBodyIk:
    """Finds q such that CoM, torso rotation and both soles are where the target wants them.

    Eighteen equations x(q) = x* in eighteen unknowns:  q ← q ⊕ J(q)⁻¹ (x* ⊖ x(q)),  quadratically convergent
    from the last tick's solution. Where J is near singular (straight knee) or a joint limit is in the way,
    `damped.nearest_posture` takes over.
    Nothing here raises: a target out of reach gives `ok = False`, a reason and the nearest q.

    Attributes:
        task_space: kinematics at the last q, to be shared with `InverseDynamics`.
    """

    def __init__(self, biped: Biped) -> None:
        self._biped = biped
        self.task_space = TaskSpace(biped)
        self._quaternion = biped.base_q_index[:4]
        self._joints, self._rates, self._fastest = biped.q_index, biped.v_index, biped.velocity_limits
        self._lower, self._upper = np.ascontiguousarray(biped.position_limits.T)

    def solve(self, target: Posture, seed: np.ndarray, loose: Side | None = None) -> IkResult:
        """The posture next to `seed` (19,) that meets the target.

        Where there is none, a `loose` foot, one that carries nothing, is what misses its target first.
        """
        if not math.isfinite(np.concatenate(target).sum()):
            return self._refused(seed, _NOWHERE)
        return self._solve(TargetPoses.of(target), seed, loose)

    def _solve(self, goal: TargetPoses, seed: np.ndarray, loose: Side | None) -> IkResult:
        if not largest(goal.offset) < _FARTHEST:
            return self._refused(seed, _NOWHERE)
        q = self._start(seed)
        q = q.copy() if self._within(q) else self._biped.clipped(q)
        task = self.task_space
        for iteration in range(NEWTON_ITERATIONS):
            task.set_positions(q)
            error = task.error(goal)
            worst = largest(error)
            if worst < TOLERANCE:
                return IkResult(q, True, iteration, worst, "")
            step = task.solved(error)
            if step is None or not largest(step) <= LARGEST_STEP:
                return self._damped(goal, q, iteration, loose)
            moved = task.moved(q, step)
            if not self._within(moved):
                return self._damped(goal, q, iteration, loose)
            q = moved
        return self._damped(goal, q, NEWTON_ITERATIONS, loose)

    def rates(self, q: np.ndarray, rates: PostureRates, weights: np.ndarray | None = None) -> np.ndarray:
        """v (18,) with J(q) v = the wanted rates; joint speeds stay within their limits near a singularity.

        With `weights` (18,), see `damped.row_weights`, for a posture that misses its target: there the legs are
        stretched, and only a damped and weighted solution is a motion that a robot can make.
        """
        self.task_space.set_positions(q)
        return self._limited(self._solved(rates.stacked(), weights))

    def accelerations(
        self, q: np.ndarray, v: np.ndarray, accelerations: PostureRates, weights: np.ndarray | None = None
    ) -> np.ndarray:
        """vdot (18,) with J(q) vdot = wanted accelerations − J̇(q, v) v; `weights` as in `rates`."""
        self.task_space.set_state(q, v)
        return self._solved(accelerations.stacked() - self.task_space.bias(), weights)

    def motion(
        self, target: Posture, rates: PostureRates, accelerations: PostureRates, seed: np.ndarray,
        loose: Side | None = None,
    ) -> Motion:  # fmt: skip
        """Positions, velocities and accelerations of one tick, with one Jacobian at the solution, factorized once."""
        found = self.solve(target, seed, loose)
        return self._moving(found, rates.stacked(), accelerations.stacked(), loose)

    def level_motion(self, wanted: np.ndarray, seed: np.ndarray, loose: Side | None = None) -> Motion:
        """The same with an upright torso and level soles that face ahead, from one array.

        Args:
            wanted: (3, 18): place, velocity and acceleration of CoM (3), torso (3, 0), left and right sole: how they
                move (3) and turn (3, 0) [m, m/s, m/s²].
        """
        found = self._solve(TargetPoses(wanted[0], *_LEVEL), seed, loose)
        return self._moving(found, wanted[1], wanted[2], loose)

    def _moving(self, found: IkResult, rates: np.ndarray, accelerations: np.ndarray, loose: Side | None) -> Motion:
        """How the robot moves at the posture found."""
        task, weights = self.task_space, None if found.ok else row_weights(loose)
        task.set_positions(found.q)
        v = self._limited(self._solved(rates, weights))
        task.set_state(found.q, v)
        return Motion(found.q, v, self._solved(accelerations - task.bias(), weights), found)

    def _within(self, q: np.ndarray) -> bool:
        """Whether every joint of q (19,) is within its limits, and its quaternion has length one."""
        return within_limits(q, self._joints, self._lower, self._upper, self._quaternion)

    def _limited(self, v: np.ndarray) -> np.ndarray:
        """v (18,), which is changed, with joint speeds within their limits."""
        limit(v, self._rates, self._fastest)
        return v

    def _solved(self, wanted: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
        """J⁻¹ wanted; damped least squares where that asks for joint motion no robot makes."""
        if weights is None:
            solution = self.task_space.solved(wanted)
            if solution is not None and largest(solution) < _WILD:
                return solution
        jacobian = self.task_space.jacobian()
        if weights is not None:
            weighted = weights[:, None] * jacobian
            normal = weighted.T @ weighted + _STRETCHED_DAMPING * np.eye(len(wanted))
            return np.linalg.solve(normal, weighted.T @ (weights * np.nan_to_num(wanted)))
        wanted = np.nan_to_num(wanted, nan=0.0, posinf=0.0, neginf=0.0)
        return np.linalg.solve(jacobian.T @ jacobian + 1e-3 * np.eye(len(wanted)), jacobian.T @ wanted)

    def _damped(self, goal: TargetPoses, q: np.ndarray, iterations: int, loose: Side | None) -> IkResult:
        q, error, more = nearest_posture(self._biped, self.task_space, goal, q, TOLERANCE, row_weights(loose))
        worst = float(abs(error).max())
        reason = "" if worst < TOLERANCE else self._reason(q, error)
        return IkResult(q, not reason, iterations + more, worst, reason)

    def _reason(self, q: np.ndarray, error: np.ndarray) -> str:
        row = int(abs(error).argmax())
        unit = "rad" if "rotation" in _ROWS[row] else "m"
        at, (lower, upper) = q[self._biped.q_index], self._biped.position_limits.T
        limited = (at <= lower + 1e-6) | (at >= upper - 1e-6)
        names = [name for name, is_limited in zip(self._biped.joint_names, limited, strict=True) if is_limited]
        held = f" with {', '.join(names)} at the limit" if names else ""
        return f"{_ROWS[row]} misses by {abs(error[row]):.2g} {unit}{held}"

    def _start(self, seed: np.ndarray) -> np.ndarray:
        """The seed, where it is a posture at all."""
        turned = largest(seed[self._quaternion]) > 0.0
        return seed if turned and largest(seed) < _FARTHEST else self._biped.bent_knee

    def _refused(self, seed: np.ndarray, reason: str) -> IkResult:
        q = self._biped.clipped(self._start(seed))
        return IkResult(q, False, 0, float("inf"), reason)
