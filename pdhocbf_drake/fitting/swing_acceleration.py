"""How far a landing may be moved for the torque of the hip that swings the leg."""

from __future__ import annotations

from typing import Final

import numpy as np

from pdhocbf_drake.robot import ROLES, Biped, InverseDynamics, WholeBodyIk, sole_pose, upright_posture
from pdhocbf_drake.robot.posture import LEFT
from pdhocbf_drake.walking.config import GaitConfig

_PEAK: Final = 1.0 / 3.0**0.5
"""Of a swing foot's acceleration, over `mpc.swing_acceleration`, where its landing is moved by all that this allows:
a quintic polynomial over a way d in a time T has a peak of 10 d/(√3 T²)."""


def swing_acceleration(biped: Biped, gait: GaitConfig) -> float:
    """The largest `mpc.swing_acceleration` with which the torques of the hips' pitch joints move a landing [m/s²].

    By inverse dynamics of the robot that stands upright at the height and width of a gait.

    Raises:
        ModelError: that is out of reach.
    """
    half, rest = gait.stance_width / 2.0, np.zeros(biped.plant.num_velocities())
    com = np.array([0.0, 0.0, gait.com_height])
    q = upright_posture(biped, com, sole_pose(0.0, half), sole_pose(0.0, -half))
    ik = WholeBodyIk(biped)
    dynamics, hip, moved = InverseDynamics(biped, ik.task_space), ROLES.index("hip_pitch"), rest.copy()
    moved[LEFT.start] = 1.0
    still, swung = (float(dynamics(q, rest, ik.derivatives(q, rest, way)[1], 0.0).tau[hip]) for way in (rest, moved))
    has = float(biped.effort_limits.reshape(2, -1)[:, hip].min())
    return has / (_PEAK * abs(swung - still))
