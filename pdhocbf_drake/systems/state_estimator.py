"""CoM, ZMP and soles from joints, base and ground reaction, for the controller."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context
from pydrake.systems.primitives import LinearSystem

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.tree_task_space import task_space_of
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.kernels import LEAST_LOAD, NO_ZMP, write_estimate
from pdhocbf_drake.systems.optional_input import OptionalInput
from pdhocbf_drake.systems.signals import places, size, sizes

(_Z_ZMP,) = places("ground_reference", "z_zmp")
_ZMP = places("lip_state", "x_zmp", "y_zmp")
_NO_ZMP = np.full(len(_ZMP), NO_ZMP)


class StateEstimator(Block):
    """CoM by kinematics, ZMP by the ground's wrench on the robot (Remark 8), here from the true state.

    The ground's generalized force on the floating base is the net contact wrench about the base's origin b:
    moment M, force F. The ZMP is the point of the ground, at height z, where its horizontal moment vanishes:
    x = b_x − (M_y + (b_z − z) F_x)/F_z,  y = b_y + (M_x − (b_z − z) F_y)/F_z. Where F_z is gone, as for a step of the
    plant when a foot lands, there is no such point, and it stays where it was at the tick before; before the first
    load it is below the CoM.

    Input ports:
        robot_state (37): q and v of the plant.
        contact_forces (18): generalized contact forces.
        ground_reference (18): as in `systems.signals`, of a walk on uneven ground, of which the height of the ZMP is
            read; in others it is 0.
        last_zmp (2): that of the tick before, see `last_zmp`; may be left unconnected.
    Output parts, see `unbundled`:
        lip_state (6), com_z (2), foot_state (12), ground_load (1): as in `systems.signals`.

    Args:
        uneven: whether the ground is not level.
    """

    def __init__(self, biped: Biped, uneven: bool = False) -> None:
        super().__init__()
        self.parts = sizes("lip_state", "com_z", "foot_state", "ground_load")
        self._size = sum(self.parts.values())
        self._task_space, self._positions = task_space_of(biped), biped.plant.num_positions()
        self._state = self.DeclareVectorInputPort("robot_state", size("robot_state"))
        self._forces = self.DeclareVectorInputPort("contact_forces", size("contact_forces"))
        self._ground = self.DeclareVectorInputPort("ground_reference", size("ground_reference")) if uneven else None
        self._least = LEAST_LOAD * biped.weight
        self._origin, self._base = biped.base_q_index[4:], biped.base_v_index
        last = self.DeclareVectorInputPort("last_zmp", len(_ZMP))
        self._last = OptionalInput(last)
        prerequisites = {self._state.ticket(), self._forces.ticket(), last.ticket()}
        prerequisites |= set() if self._ground is None else {self._ground.ticket()}
        self._estimate = self.DeclareVectorOutputPort("estimate", self._size, weakly(self._calc), prerequisites)

    def _calc(self, context: Context, output: BasicVector) -> None:
        forces = self._forces.Eval(context)  # before all else here, which its contact solve would drive from the cache
        task, state = self._task_space, self._state.Eval(context)
        poses, velocity = task.poses_and_velocity(state[: self._positions], state[self._positions :])
        held, estimate, ground = self._last(context), np.empty(self._size), 0.0
        if self._ground is not None:
            ground = float(self._ground.Eval(context)[_Z_ZMP])
        held = _NO_ZMP if held is None else held
        write_estimate(poses, velocity, state, self._origin, forces, self._base, ground, self._least, held, estimate)
        output.SetFromVector(estimate)


def last_zmp(tick: float) -> LinearSystem:
    """From lip_state to its ZMP of the tick δ [s] before: memory of a `StateEstimator`, without a call of Python."""
    count = len(_ZMP)
    none, one = np.zeros((count, count)), np.eye(count)
    memory = LinearSystem(none, np.eye(size("lip_state"))[_ZMP], one, np.zeros((count, size("lip_state"))), tick)
    memory.configure_default_state(_NO_ZMP)
    return memory
