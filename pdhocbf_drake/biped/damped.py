"""The nearest posture within the joint limits, where Newton's method has none to offer: straight knees, limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pdhocbf_drake.biped.task_space import TargetPoses, TaskSpace

if TYPE_CHECKING:
    from pdhocbf_drake.biped.robot import Biped

ITERATIONS = 40
# What is given up first where not everything can be had: CoM and torso, before the soles.
WEIGHTS = np.repeat([1.0, 1.0, 10.0], [3, 3, 12])


def nearest_posture(
    biped: Biped, task_space: TaskSpace, goal: TargetPoses, q: np.ndarray, tolerance: float
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
        jacobian = WEIGHTS[:, None] * task_space.jacobian()
        gradient = jacobian.T @ (WEIGHTS * error)
        joints, outward = q[biped.q_index], gradient[biped.v_index]
        free = np.ones(len(gradient), dtype=bool)
        free[biped.v_index] = ~((joints <= lower) & (outward < 0) | (joints >= upper) & (outward > 0))
        normal = (jacobian.T @ jacobian)[np.ix_(free, free)]
        step = np.zeros(len(gradient))
        step[free] = np.linalg.solve(normal + damping * np.eye(len(normal)), gradient[free])
        trial = biped.clipped(task_space.moved(q, step))
        task_space.set_positions(trial)
        trial_error = task_space.error(goal)
        if np.linalg.norm(WEIGHTS * trial_error) < np.linalg.norm(WEIGHTS * error):
            change = float(abs(trial - q).max())
            q, error, damping = trial, trial_error, max(damping / 5, 1e-12)
            if change < 1e-9:
                break
        else:
            damping *= 10
            task_space.set_positions(q)
    return q, error, iterations
