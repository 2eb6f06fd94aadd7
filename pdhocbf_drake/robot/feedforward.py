"""Inverse dynamics: joint torques and contact wrenches of a whole-body motion, and how a swing foot moves the ZMP."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.config import Side
from pdhocbf_drake.robot.ik import LEVEL, IkResult, Motion, WholeBodyIk
from pdhocbf_drake.robot.multibody.kernels import write_shared_wrench
from pdhocbf_drake.robot.posture import LEFT, TORSO_TURN, TargetPoses
from pdhocbf_drake.robot.task_space import TaskSpace
from pdhocbf_drake.robot.tree_task_space import task_space_of


class Feedforward(NamedTuple):
    """Torques (12,) [N m] and the ground's wrench on each sole, at its centre: force (3) [N], moment (3) [N m]."""

    tau: np.ndarray
    left: np.ndarray
    right: np.ndarray


class InverseDynamics:
    """Solves  M(q) v̇ + C(q, v) v − τ_g(q) = S τ + J_leftᵀ w_left + J_rightᵀ w_right  for τ and the wrenches.

    The six rows of the floating base have no actuator, so they determine the sum of the wrenches; `left_share`
    is the part of its force, and of the moment that then remains, that the left sole carries. With the share
    that the ZMP has between the soles (`kernels.left_share_of_zmp`), each wrench acts inside its own sole.
    """

    def __init__(self, biped: Biped, task_space: TaskSpace | None = None) -> None:
        """Shares the kinematics of a `WholeBodyIk` when given its task space."""
        self._base, self._joints = biped.base_v_index, biped.v_index
        self._origin = biped.base_q_index[4:]
        self._task_space = task_space or task_space_of(biped)

    def __call__(self, q: np.ndarray, v: np.ndarray, vdot: np.ndarray, left_share: float) -> Feedforward:
        """Torques of the motion (q (19,), v (18,), vdot (18,)); `left_share` in [0, 1]."""
        task = self._task_space
        task.set_state(q, v)
        needed = task.forces(vdot)
        jacobian, out = task.jacobian(), np.empty(24)
        write_shared_wrench(needed, self._base, self._joints, q, self._origin, task.poses(), left_share, jacobian, out)
        return Feedforward(out[:12], out[12:18], out[18:])

    def along(
        self, ik: WholeBodyIk, wanted: np.ndarray, seed: np.ndarray, share: float, loose: Side | None = None,
        angles: tuple[float, ...] = LEVEL,
    ) -> tuple[Motion, Feedforward]:  # fmt: skip
        """`ik.motion` and its torques, in one call where that is possible.

        Args:
            ik: whose kinematics are shared.
            wanted, seed, loose, angles: of `ik.motion`. share: of the load, on the left sole.
        """
        found = ik.task_space.move_along(TargetPoses(wanted[0], *angles), seed, wanted, share)
        if found is None:
            motion = ik.motion(wanted, seed, loose, angles)
            return motion, self(motion.q, motion.v, motion.vdot, share)
        q, v, vdot, tau, steps, worst = found
        motion = Motion(q, v, vdot, IkResult(q, True, steps, worst, ""))
        return motion, Feedforward(tau[:12], tau[12:18], tau[18:])


def swing_lever(biped: Biped, q: np.ndarray) -> np.ndarray:
    """ZMP displacement in x and y per unit of the swing foot's acceleration that way, shape (2,) [s²].

    With CoM and torso on their planned motion, an accelerated leg changes the angular momentum, and with it the moment
    of the ground reaction. In posture `q` (19,) the left foot swings and the right one stands.
    """
    ik = WholeBodyIk(biped)
    dynamics = InverseDynamics(biped, ik.task_space)
    rest = np.zeros(biped.plant.num_velocities())

    def zmp(swing: np.ndarray) -> np.ndarray:
        accelerations = np.zeros_like(rest)
        accelerations[LEFT] = swing
        _, vdot = ik.derivatives(q, rest, accelerations)
        wrench = dynamics(q, rest, vdot, 0.0).right
        return np.array([-wrench[4], wrench[3]]) / wrench[2]

    still = zmp(np.zeros(3))
    forward, lateral = np.eye(3)[:2]
    return np.array([(zmp(forward) - still)[0], (zmp(lateral) - still)[1]])


def torso_yaw_lever(biped: Biped, q: np.ndarray) -> float:
    """The ground's moment about the vertical per yaw acceleration of the torso, over the vertical force [m s²].

    In posture `q` (19,) the right foot carries the robot.
    """
    ik = WholeBodyIk(biped)
    dynamics = InverseDynamics(biped, ik.task_space)
    rest = np.zeros(biped.plant.num_velocities())
    turning = rest.copy()
    turning[TORSO_TURN.start + 2] = 1.0
    wrenches = [dynamics(q, rest, ik.derivatives(q, rest, wanted)[1], 0.0).right for wanted in (rest, turning)]
    return float(wrenches[1][5] / wrenches[1][2] - wrenches[0][5] / wrenches[0][2])
