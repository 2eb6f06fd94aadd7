"""What a swinging foot does to the ZMP."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.robot.feedforward import InverseDynamics
from pdhocbf_drake.robot.ik import WholeBodyIk
from pdhocbf_drake.robot.posture import PostureRates
from pdhocbf_drake.robot.robot import Biped


def swing_lever(biped: Biped, q: np.ndarray) -> np.ndarray:
    """How far the ZMP moves in x and y for a unit acceleration of the swing foot that way, shape (2,) [s²].

    With CoM and torso on their course, a leg that accelerates changes the angular momentum, and the ground's moment
    with it. The left foot of posture `q` (19,) swings, the right one stands.
    """
    ik = WholeBodyIk(biped)
    dynamics = InverseDynamics(biped, ik.task_space)
    rest = np.zeros(biped.plant.num_velocities())

    def zmp(swing: np.ndarray) -> np.ndarray:
        still = np.zeros(6)
        vdot = ik.accelerations(q, rest, PostureRates(np.zeros(3), swing, still))
        wrench = dynamics(q, rest, vdot, 0.0).right
        return np.array([-wrench[4], wrench[3]]) / wrench[2]

    ahead, aside = np.eye(6)[:2]
    still = zmp(np.zeros(6))
    return np.array([(zmp(ahead) - still)[0], (zmp(aside) - still)[1]])
