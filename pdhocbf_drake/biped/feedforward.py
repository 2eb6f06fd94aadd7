"""Joint torques and contact wrenches that make the planned whole-body motion happen: inverse dynamics."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pydrake.multibody.tree import MultibodyForces

from pdhocbf_drake.biped.task_space import TaskSpace

if TYPE_CHECKING:
    from pdhocbf_drake.biped.robot import Biped


class Feedforward(NamedTuple):
    """Torques (12,) [N m] and the ground's wrench on each sole, at its centre: force (3) [N], moment (3) [N m]."""

    tau: np.ndarray
    left: np.ndarray
    right: np.ndarray


class InverseDynamics:
    """Solves  M(q) v̇ + C(q, v) v − τ_g(q) = S τ + J_leftᵀ w_left + J_rightᵀ w_right  for τ and the wrenches.

    The six rows of the floating base hold no motor, so they fix the sum of the wrenches; `left_share`
    says how much of its force, and of the moment that then remains, the left sole carries. With the share
    that the ZMP has between the soles (`left_share_of_zmp`), each wrench acts inside its own sole.
    """

    def __init__(self, biped: Biped, task_space: TaskSpace | None = None) -> None:
        """Shares the kinematics of a `WholeBodyIk` when given its task space."""
        self._plant = biped.plant
        self._base, self._joints = biped.base_v_index, biped.v_index
        self._base_position = biped.base_q_index[4:]
        self._task_space = task_space or TaskSpace(biped)
        self._forces = MultibodyForces(biped.plant)

    def __call__(self, q: np.ndarray, v: np.ndarray, vdot: np.ndarray, left_share: float) -> Feedforward:
        """Torques of the motion (q (19,), v (18,), vdot (18,)); `left_share` in [0, 1]."""
        task, plant = self._task_space, self._plant
        task.set_state(q, v)
        # CalcInverseDynamics leaves gravity and joint damping out unless they are among the applied forces.
        plant.CalcForceElementsContribution(task.context, self._forces)
        needed = plant.CalcInverseDynamics(task.context, vdot, self._forces)
        moment, force = needed[self._base[:3]], needed[self._base[3:]]  # of the ground, about the base's origin
        left, right = (sole - q[self._base_position] for sole in task.sole_positions())
        right_share = 1.0 - left_share
        remaining = moment - _cross(left_share * left + right_share * right, force)
        on_left = np.concatenate([left_share * force, left_share * remaining])
        on_right = np.concatenate([right_share * force, right_share * remaining])
        generalized = task.jacobian()[6:].T @ np.concatenate([on_left, on_right])
        return Feedforward((needed - generalized)[self._joints], on_left, on_right)


def left_share_of_zmp(zmp: np.ndarray, left: np.ndarray, right: np.ndarray) -> float:
    """Where the ZMP (2,) projects on the way from the right sole's centre (2,) to the left's: 0 … 1."""
    way = left - right
    return float(np.clip((zmp - right) @ way / (way @ way), 0.0, 1.0))


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """np.cross for two 3-vectors, without its 20 µs of generality."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
