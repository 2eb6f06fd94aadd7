"""How joint accelerations, torques and the ground's wrenches change with the tasks' accelerations and the load."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.posture import LEFT, RIGHT
from pdhocbf_drake.robot.task_space import TaskSpace
from pdhocbf_drake.whole_body.kernels import WRENCH

_ORIGINS = ([18, 22, 26], [30, 34, 38])  # of left and right sole in poses (39,)
_SOLES = (slice(LEFT.start, LEFT.start + WRENCH), slice(RIGHT.start, RIGHT.start + WRENCH))  # place and turn


class Columns(NamedTuple):
    """Change of a motion for each decision: some directions of v̇, then a wrench that the left sole takes over.

    Along K, v̇ changes by K ζ and the generalized forces by M K ζ. Its rows of the floating base are what the ground
    gives, shared between the soles as in `robot.kernels.write_shared_wrench`.

    Attributes:
        vdot: (18, n). tau: (12, n). wrenches: on the left, then the right sole, (12, n).
    """

    vdot: np.ndarray
    tau: np.ndarray
    wrenches: np.ndarray


def along_tasks(task: TaskSpace, tasks: np.ndarray) -> np.ndarray | None:
    """The columns of J⁻¹ that belong to some tasks (18, n), at the q that is set; None where J is singular."""
    found = [task.solve(row) for row in np.eye(18)[tasks]]
    columns = [column for column in found if column is not None and np.isfinite(column).all()]
    return np.array(columns).T if len(columns) == len(tasks) else None


def columns(biped: Biped, task: TaskSpace, q: np.ndarray, directions: np.ndarray, share: float) -> Columns:
    """The columns at q (19,), which is set in the task space.

    Args:
        directions: K, of v̇, (18, n).
        share: of the load, on the left sole; where both carry some, six more decisions are how they share it, a force
            and a moment over the robot's weight.
    """
    jacobian, poses, count = task.jacobian(), task.poses(), directions.shape[1]
    both = 0.0 < share < 1.0
    vdot = np.zeros((18, count + WRENCH * both))
    forces = np.zeros_like(vdot)
    vdot[:, :count], forces[:, :count] = directions, task.inertial_forces(directions)
    left, right = (poses[origin] for origin in _ORIGINS)
    force, moment = forces[biped.base_v_index[3:]], forces[biped.base_v_index[:3]]
    middle = share * left + (1.0 - share) * right - q[biped.base_q_index[4:]]
    about = np.concatenate([force, moment - _cross(middle) @ force])
    wrenches = np.concatenate([share * about, (1.0 - share) * about])
    if both:
        taken = biped.weight * np.eye(WRENCH)
        given = -taken.copy()
        given[3:, :3] = -biped.weight * _cross(left - right)
        wrenches[:, count:] = np.concatenate([taken, given])
    tau = forces[biped.v_index]
    for sole, rows in enumerate(_SOLES):
        tau = tau - jacobian[rows, biped.v_index].T @ wrenches[WRENCH * sole : WRENCH * (sole + 1)]
    return Columns(vdot, tau, wrenches)


def _cross(a: np.ndarray) -> np.ndarray:
    """The matrix of b → a × b, (3, 3)."""
    x, y, z = a.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
