"""Whole-body inverse kinematics: a square Newton iteration with a damped fallback that respects joint limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pdhocbf_drake.biped.posture import Posture, PostureRates
from pdhocbf_drake.biped.task_space import TargetPoses, TaskSpace

if TYPE_CHECKING:
    from pdhocbf_drake.biped.robot import Biped

TOLERANCE = 1e-8  # greatest entry of the task error [m, rad]
NEWTON_ITERATIONS = 12
LARGEST_STEP = 0.5  # a joint step beyond this says that the Jacobian is near singular [rad]
FALLBACK_ITERATIONS = 40
# What the fallback gives up first where not everything can be had: CoM and torso, before the soles.
_FALLBACK_WEIGHTS = np.repeat([1.0, 1.0, 10.0], [3, 3, 12])
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
    a Levenberg-Marquardt iteration with the blocked joints taken out finds the nearest posture instead.
    Nothing here raises: a target out of reach gives `ok = False`, a reason and the nearest q.

    Attributes:
        task_space: kinematics at the last q, to be shared with `InverseDynamics`.
    """

    def __init__(self, biped: Biped) -> None:
        self._biped = biped
        self._joints = biped.q_index
        self._lower, self._upper = biped.position_limits.T
        self.task_space = TaskSpace(biped)

    def solve(self, target: Posture, seed: np.ndarray) -> IkResult:
        """The posture next to `seed` (19,) that meets the target."""
        if not np.isfinite(np.concatenate(target)).all():
            return self._refused(seed, "the target is not finite")
        q = self._within_limits(seed if np.isfinite(seed).all() else self._biped.bent_knee)
        goal = TargetPoses(target)
        for iteration in range(NEWTON_ITERATIONS):
            self.task_space.set_positions(q)
            error = self.task_space.error(goal)
            worst = float(abs(error).max())
            if worst < TOLERANCE:
                return IkResult(q, True, iteration, worst, "")
            try:
                step = np.linalg.solve(self.task_space.jacobian(), error)
            except np.linalg.LinAlgError:
                return self._damped(goal, q, iteration)
            moved = self._moved(q, step)
            if abs(step).max() > LARGEST_STEP or not self._inside(moved):
                return self._damped(goal, q, iteration)
            q = moved
        return self._damped(goal, q, NEWTON_ITERATIONS)

    def rates(self, q: np.ndarray, rates: PostureRates) -> np.ndarray:
        """v (18,) with J(q) v = the wanted rates; joint speeds stay within their limits near a singularity."""
        self.task_space.set_positions(q)
        v = self._solved(rates.stacked())
        limits, joints = self._biped.velocity_limits, self._biped.v_index
        v[joints] = np.clip(v[joints], -limits, limits)
        return v

    def accelerations(self, q: np.ndarray, v: np.ndarray, accelerations: PostureRates) -> np.ndarray:
        """vdot (18,) with J(q) vdot = wanted accelerations − J̇(q, v) v."""
        self.task_space.set_state(q, v)
        return self._solved(accelerations.stacked() - self.task_space.bias())

    def motion(self, target: Posture, rates: PostureRates, accelerations: PostureRates, seed: np.ndarray) -> Motion:
        """Positions, velocities and accelerations of one tick, with one Jacobian at the solution."""
        ik = self.solve(target, seed)
        v = self.rates(ik.q, rates)
        return Motion(ik.q, v, self.accelerations(ik.q, v, accelerations), ik)

    def _solved(self, wanted: np.ndarray) -> np.ndarray:
        """J⁻¹ wanted; damped least squares where that asks for joint motion no robot makes."""
        jacobian = self.task_space.jacobian()
        try:
            solution = np.linalg.solve(jacobian, wanted)
            if abs(solution).max() < 1e3:
                return solution
        except np.linalg.LinAlgError:
            pass
        wanted = np.nan_to_num(wanted, nan=0.0, posinf=0.0, neginf=0.0)
        return np.linalg.solve(jacobian.T @ jacobian + 1e-3 * np.eye(len(wanted)), jacobian.T @ wanted)

    def _damped(self, goal: TargetPoses, q: np.ndarray, iterations: int) -> IkResult:
        """Levenberg-Marquardt on the weighted task error, joints kept within their limits."""
        damping, weights, joints = 1e-3, _FALLBACK_WEIGHTS, self._biped.v_index
        self.task_space.set_positions(q)
        error = self.task_space.error(goal)
        for _ in range(FALLBACK_ITERATIONS):
            if abs(error).max() < TOLERANCE:
                break
            iterations += 1
            jacobian = weights[:, None] * self.task_space.jacobian()
            gradient = jacobian.T @ (weights * error)
            free = np.ones(len(gradient), dtype=bool)
            at = q[self._joints]
            pushed_out = gradient[joints]
            free[joints] = ~((at <= self._lower) & (pushed_out < 0) | (at >= self._upper) & (pushed_out > 0))
            normal = (jacobian.T @ jacobian)[np.ix_(free, free)]
            step = np.zeros(len(gradient))
            step[free] = np.linalg.solve(normal + damping * np.eye(len(normal)), gradient[free])
            trial = self._within_limits(self._moved(q, step))
            self.task_space.set_positions(trial)
            trial_error = self.task_space.error(goal)
            if np.linalg.norm(weights * trial_error) < np.linalg.norm(weights * error):
                moved = float(abs(trial - q).max())
                q, error, damping = trial, trial_error, max(damping / 5, 1e-12)
                if moved < 1e-9:
                    break
            else:
                damping *= 10
                self.task_space.set_positions(q)
                if damping > 1e6:
                    break
        self.task_space.set_positions(q)
        worst = float(abs(error).max())
        reason = "" if worst < TOLERANCE else self._reason(q, error)
        return IkResult(q, not reason, iterations, worst, reason)

    def _reason(self, q: np.ndarray, error: np.ndarray) -> str:
        row = int(abs(error).argmax())
        unit = "rad" if "rotation" in _ROWS[row] else "m"
        at = q[self._joints]
        limited = (at <= self._lower + 1e-6) | (at >= self._upper - 1e-6)
        names = [name for name, is_limited in zip(self._biped.joint_names, limited, strict=True) if is_limited]
        held = f" with {', '.join(names)} at the limit" if names else ""
        return f"{_ROWS[row]} misses by {abs(error[row]):.2g} {unit}{held}"

    def _refused(self, seed: np.ndarray, reason: str) -> IkResult:
        q = self._within_limits(seed if np.isfinite(seed).all() else self._biped.bent_knee)
        return IkResult(q, False, 0, float("inf"), reason)

    def _moved(self, q: np.ndarray, step: np.ndarray) -> np.ndarray:
        """q ⊕ step: along q̇ = N(q) v, quaternion normalized."""
        self.task_space.set_positions(q)
        moved: np.ndarray = q + self._biped.plant.MapVelocityToQDot(self.task_space.context, step)
        quaternion = self._biped.base_q_index[:4]
        moved[quaternion] /= np.linalg.norm(moved[quaternion])
        return moved

    def _inside(self, q: np.ndarray) -> bool:
        at = q[self._joints]
        return bool((at >= self._lower).all() and (at <= self._upper).all())

    def _within_limits(self, q: np.ndarray) -> np.ndarray:
        """A copy with joints clipped to their limits and the quaternion normalized."""
        clipped = np.array(q, dtype=float)
        clipped[self._joints] = np.clip(clipped[self._joints], self._lower, self._upper)
        quaternion = self._biped.base_q_index[:4]
        clipped[quaternion] /= max(float(np.linalg.norm(clipped[quaternion])), 1e-12)
        return clipped
