"""The length of a robot's legs."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.config import SIDES


def leg_length(biped: Biped) -> float:
    """Thigh and shank of the longer leg: distances of the axes of hip pitch, knee and ankle pitch, to 0.1 mm [m]."""
    plant, names = biped.plant, biped.joint_names
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, biped.bent_knee)
    lengths = []
    for number in range(len(SIDES)):
        hip, knee, ankle = (axis_of(biped, context, names[6 * number + role])[0] for role in (2, 3, 4))
        across = axis_of(biped, context, names[6 * number + 3])[1]
        # A joint may have its origin anywhere along its axis.
        parts = [way - across * (across @ way) for way in (knee - hip, ankle - knee)]
        lengths.append(sum(float(np.linalg.norm(part)) for part in parts))
    return round(max(lengths), 4)


def axis_of(biped: Biped, context: object, joint: str) -> tuple[np.ndarray, np.ndarray]:
    """A point of a joint's axis (3,) [m] and its direction (3,), in the world."""
    plant: MultibodyPlant = biped.plant
    there = plant.GetJointByName(joint)
    pose = there.frame_on_parent().CalcPoseInWorld(context)
    return pose.translation(), pose.rotation() @ there.revolute_axis()
