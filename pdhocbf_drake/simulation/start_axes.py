"""A simulated robot that starts at a heading, in coordinates along that heading.

Drake's contact solver stops where the momentum that is left is small in the plant's coordinates. Along the world's
axes that is elsewhere for each heading, by 1e-6 of the momentum, and a walk carries the difference on. A floating base
that is counted along the axes of its start makes all headings the same plant.
"""

from __future__ import annotations

import math

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, QuaternionFloatingJoint

from pdhocbf_drake.robot import Biped


def add_base(plant: MultibodyPlant, biped: Biped, yaw: float) -> None:
    """Gives the robot in a plant that is not finalized its floating base, along axes at a heading [rad]."""
    frame = FixedOffsetFrame("start", plant.world_frame(), RigidTransform(RollPitchYaw(0.0, 0.0, yaw), np.zeros(3)))
    base = plant.GetBodyByName(biped.config.base_link)
    plant.AddJoint(QuaternionFloatingJoint(base.name(), plant.AddFrame(frame), base.body_frame()))


def positions_to_world(biped: Biped, yaw: float) -> np.ndarray:
    """The matrix (19, 19) that leads from q along the axes of the start to q along those of the world."""
    matrix = np.eye(biped.plant.num_positions())
    c, s = math.cos(yaw / 2.0), math.sin(yaw / 2.0)
    w, x, y, z = biped.base_q_index[:4]
    for i, j, sign in ((w, z, -1.0), (x, y, -1.0), (y, x, 1.0), (z, w, 1.0)):  # quaternion of the yaw times q's
        matrix[i, i], matrix[i, j] = c, sign * s
    _turn(matrix, biped.base_q_index[4:6], yaw)
    return matrix


def velocities_to_world(biped: Biped, yaw: float) -> np.ndarray:
    """The same (18, 18) for velocities, and for generalized forces."""
    matrix = np.eye(biped.plant.num_velocities())
    for pair in (biped.base_v_index[:2], biped.base_v_index[3:5]):
        _turn(matrix, pair, yaw)
    return matrix


def state_to_world(biped: Biped, yaw: float) -> np.ndarray:
    """The same (37, 37) for the plant's state."""
    count = biped.plant.num_positions()
    matrix = np.eye(count + biped.plant.num_velocities())
    matrix[:count, :count], matrix[count:, count:] = positions_to_world(biped, yaw), velocities_to_world(biped, yaw)
    return matrix


def _turn(matrix: np.ndarray, pair: np.ndarray, yaw: float) -> None:
    c, s = math.cos(yaw), math.sin(yaw)
    matrix[np.ix_(pair, pair)] = [[c, -s], [s, c]]
