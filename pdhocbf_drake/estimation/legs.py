"""CoM and soles as the joints place them in the floating link, and how they move with the joints."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.posture import COM, LEFT, LEFT_TURN, RIGHT, RIGHT_TURN
from pdhocbf_drake.robot.tree_task_space import task_space_of

_PLACES, _TURNS = (LEFT, RIGHT), (LEFT_TURN, RIGHT_TURN)
_FRAMES = (15, 27)  # in poses: rotation and origin of left and right sole, (3, 4) row by row


class Legs:
    """Kinematics in the floating link's axes, from its origin, at the angles of the last `set_joints`.

    Attributes:
        mass: of the robot [kg]. weight: its weight [N].
        com: centre of mass (3,) [m]. com_rates: ∂com/∂θ (3, 12) [m/rad].
        ways: the soles' centres (2, 3) [m]. way_rates: ∂ways/∂θ (2, 3, 12) [m/rad].
        turns: the soles' rotations (2, 9), row by row. turn_rates: their angular velocity per joint rate (2, 3, 12).
    """

    def __init__(self, biped: Biped) -> None:
        self.mass, self.weight = biped.mass, biped.weight
        self._space, self._joints, self._columns = task_space_of(biped), biped.q_index, biped.v_index
        self._q = np.zeros(biped.plant.num_positions())
        self._q[biped.base_q_index[0]] = 1.0
        count = len(biped.q_index)
        self.com, self.com_rates = np.empty(3), np.empty((3, count))
        self.ways, self.way_rates = np.empty((2, 3)), np.empty((2, 3, count))
        self.turns, self.turn_rates = np.empty((2, 9)), np.empty((2, 3, count))

    def set_joints(self, joints: np.ndarray) -> None:
        """Moves the joints to angles (12,) [rad], in the order of `signals.JOINTS`."""
        self._q[self._joints] = joints
        self._space.set_positions(self._q)
        poses, jacobian = self._space.poses(), self._space.jacobian()[:, self._columns]
        self.com[:], self.com_rates[:] = poses[:3], jacobian[COM]
        for side in (0, 1):
            frame = poses[_FRAMES[side] : _FRAMES[side] + 12].reshape(3, 4)
            self.turns[side], self.ways[side] = frame[:, :3].ravel(), frame[:, 3]
            self.way_rates[side], self.turn_rates[side] = jacobian[_PLACES[side]], jacobian[_TURNS[side]]
