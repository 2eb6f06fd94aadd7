"""Damped inverse kinematics within the joint limits, for targets that Newton's method does not reach."""

from __future__ import annotations

import numpy as np
from pydrake.math import RotationMatrix

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.config import SIDES, Side
from pdhocbf_drake.robot.posture import TargetPoses
from pdhocbf_drake.robot.task_space import TOLERANCE, TaskSpace

_ITERATIONS = 40
# Weights of the task error: the soles count ten times as much as CoM and torso.
_WEIGHTS = np.repeat([1.0, 1.0, 10.0], [3, 3, 12])

# A swing foot may trail, hang lower and pitch over its toes, but must not cross to the other foot's side.
_LOOSE = (0.5, 10.0, 0.5, 10.0, 0.1, 10.0)


def row_weights(loose: Side | None, yaw: float = 0.0) -> np.ndarray:
    """Weights W of the task error (18, 18); the rows of a loose foot, which carries no load, weigh least.

    They are those along the axes of a torso with heading `yaw` [rad].
    """
    if loose is None:
        return np.diag(_WEIGHTS)
    feet = [_LOOSE if side == loose else (30.0,) * 6 for side in SIDES]
    weights = np.diag([3.0] * 6 + [weight for foot in feet for weight in foot])
    return weights @ np.kron(np.eye(6), RotationMatrix.MakeZRotation(-yaw).matrix()) if yaw else weights


def nearest_posture(
    biped: Biped, task_space: TaskSpace, goal: TargetPoses, q: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    """Levenberg-Marquardt on the weighted task error e; joints that a limit blocks are left out of the step:

        step = (JᵀW²J + λ I)⁻¹ JᵀW² e,    q ← clip(q ⊕ step),    λ smaller after a success, larger after a failure.

    Returns:
        q (19,) within the limits, its task error (18,) [m, rad], and the number of iterations.
    """
    lower, upper = biped.position_limits.T
    q, iterations, damping, done = task_space.descend(goal, q, weights, _ITERATIONS)
    task_space.set_positions(q)
    error = task_space.error(goal)
    while not done and iterations < _ITERATIONS and damping < 1e6 and abs(error).max() >= TOLERANCE:
        iterations += 1
        jacobian = weights @ task_space.jacobian()
        gradient = jacobian.T @ (weights @ error)
        joints, outward = q[biped.q_index], gradient[biped.v_index]
        free = np.ones(len(gradient), dtype=bool)
        free[biped.v_index] = ~((joints <= lower) & (outward < 0) | (joints >= upper) & (outward > 0))
        normal = (jacobian.T @ jacobian)[np.ix_(free, free)]
        step = np.zeros(len(gradient))
        step[free] = np.linalg.solve(normal + damping * np.eye(len(normal)), gradient[free])
        trial = biped.clipped(task_space.moved(q, step))
        task_space.set_positions(trial)
        trial_error = task_space.error(goal)
        if np.linalg.norm(weights @ trial_error) < np.linalg.norm(weights @ error):
            change = float(abs(trial - q).max())
            q, error, damping = trial, trial_error, max(damping / 5, 1e-12)
            if change < 1e-9:
                break
        else:
            damping *= 10
            task_space.set_positions(q)
    return q, error, iterations
