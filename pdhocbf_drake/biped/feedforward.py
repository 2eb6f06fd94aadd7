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
        # Of the ground: moment about the base's origin and force, then the lever of that force at the shared point.
        mx, my, mz, fx, fy, fz = needed[self._base].tolist()
        left, right = (sole.tolist() for sole in task.sole_positions())
        share, rest = left_share, 1.0 - left_share
        base = q[self._base_position].tolist()
        x, y, z = (share * a + rest * b - c for a, b, c in zip(left, right, base, strict=True))
        wrench = np.array([fx, fy, fz, mx - (y * fz - z * fy), my - (z * fx - x * fz), mz - (x * fy - y * fx)])
        both = np.concatenate([share * wrench, rest * wrench])
        needed -= both @ task.jacobian()[6:]
        return Feedforward(needed[self._joints], both[:6], both[6:])


def left_share_of_zmp(zmp: np.ndarray, left: np.ndarray, right: np.ndarray) -> float:
    """Where the ZMP (2,) projects on the way from the right sole's centre (2,) to the left's: 0 … 1."""
    (x, y), (from_x, from_y), (to_x, to_y) = zmp.tolist(), right.tolist(), left.tolist()
    way_x, way_y = to_x - from_x, to_y - from_y
    length = way_x * way_x + way_y * way_y
    if length == 0.0:
        return 0.5
    return min(max(((x - from_x) * way_x + (y - from_y) * way_y) / length, 0.0), 1.0)
