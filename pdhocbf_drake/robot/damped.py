"""The nearest posture within the joint limits, where Newton's method has none to offer: straight knees, limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pdhocbf_drake.robot.config import SIDES, Side
from pdhocbf_drake.robot.task_space import TargetPoses, TaskSpace

if TYPE_CHECKING:
    from pdhocbf_drake.robot.robot import Biped

ITERATIONS = 40
# What is given up first where not everything can be had: CoM and torso, before the soles.
WEIGHTS = np.repeat([1.0, 1.0, 10.0], [3, 3, 12])

# A foot that carries nothing may trail, hang lower and tip over its toes, but stays on its own side of the other one.
_LOOSE = (0.5, 10.0, 0.5, 10.0, 0.1, 10.0)


def row_weights(loose: Side | None) -> np.ndarray:
    """What counts how much where not everything can be had, (18,); a loose foot is given up before all else."""
    if loose is None:
        return WEIGHTS
    feet = [_LOOSE if side == loose else (30.0,) * 6 for side in SIDES]
    return np.array([3.0] * 6 + [weight for foot in feet for weight in foot])


def nearest_posture(
    biped: Biped,
    task_space: TaskSpace,
    goal: TargetPoses,
    q: np.ndarray,
    tolerance: float,
    weights: np.ndarray = WEIGHTS,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Levenberg-Marquardt on the weighted task error e, with joints at a limit taken out while it blocks them:

        step = (JᵀW²J + λ I)⁻¹ JᵀW² e,    q ← clip(q ⊕ step),    λ smaller after a success, larger after a failure.

    Returns:
        q (19,) within the limits, its task error (18,) [m, rad], and the number of iterations.
    """
    lower, upper = biped.position_limits.T
    damping, iterations = 1e-3, 0
    task_space.set_positions(q)
    error = task_space.error(goal)
    while iterations < ITERATIONS and damping < 1e6 and abs(error).max() >= tolerance:
        iterations += 1
        jacobian = weights[:, None] * task_space.jacobian()
        gradient = jacobian.T @ (weights * error)
        joints, outward = q[biped.q_index], gradient[biped.v_index]
        free = np.ones(len(gradient), dtype=bool)
        free[biped.v_index] = ~((joints <= lower) & (outward < 0) | (joints >= upper) & (outward > 0))
        normal = (jacobian.T @ jacobian)[np.ix_(free, free)]
        step = np.zeros(len(gradient))
        step[free] = np.linalg.solve(normal + damping * np.eye(len(normal)), gradient[free])
        trial = biped.clipped(task_space.moved(q, step))
        task_space.set_positions(trial)
        trial_error = task_space.error(goal)
        if np.linalg.norm(weights * trial_error) < np.linalg.norm(weights * error):
            change = float(abs(trial - q).max())
            q, error, damping = trial, trial_error, max(damping / 5, 1e-12)
            if change < 1e-9:
                break
        else:
            damping *= 10
            task_space.set_positions(q)
    return q, error, iterations
