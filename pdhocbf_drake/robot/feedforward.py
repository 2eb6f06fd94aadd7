"""Joint torques and contact wrenches that make the planned whole-body motion happen: inverse dynamics."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from pydrake.multibody.tree import MultibodyForces

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.robot.task_space import TaskSpace

if TYPE_CHECKING:
    from pdhocbf_drake.robot.robot import Biped


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
        both, origin = np.empty(12), q[self._base_position]
        write_shared_wrench(needed, self._base, origin, task.places(), left_share, task.jacobian(), both)
        return Feedforward(needed[self._joints], both[:6], both[6:])


@compiled
def write_shared_wrench(
    needed: np.ndarray, base: np.ndarray, origin: np.ndarray, places: np.ndarray, share: float, jacobian: np.ndarray,
    both: np.ndarray,
) -> None:  # fmt: skip
    """Takes the ground's part out of the generalized forces `needed` (18,); writes the wrenches on both soles (12,)."""
    # Of the ground: moment about the base's origin and force, then the lever of that force at the shared point.
    mx, my, mz = needed[base[0]], needed[base[1]], needed[base[2]]
    fx, fy, fz = needed[base[3]], needed[base[4]], needed[base[5]]
    rest = 1.0 - share
    # Places are CoM (3), then rotation and origin (3 x 4) of torso, left and right sole.
    x = share * places[18] + rest * places[30] - origin[0]
    y = share * places[22] + rest * places[34] - origin[1]
    z = share * places[26] + rest * places[38] - origin[2]
    wrench = (fx, fy, fz, mx - (y * fz - z * fy), my - (z * fx - x * fz), mz - (x * fy - y * fx))
    for i in range(6):
        both[i], both[6 + i] = share * wrench[i], rest * wrench[i]
    for j in range(18):
        for i in range(12):
            needed[j] -= both[i] * jacobian[6 + i, j]
