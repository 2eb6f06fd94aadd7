"""A robot with straight legs and an upright torso, from which entries of its file are checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame

from pdhocbf_drake.robot.config import SIDES, RobotConfig, Side

KNEE = 3  # of the joints of a leg, in the order of `ROLES`


class StraightPose:
    """The robot with its torso upright and all joints at zero, seen along the torso's axes.

    Attributes:
        axes, origins: of the twelve joints, shape (12, 3); origins [m].
        limits: (12, 2) [rad]. bent: bent_knee as it is given (12,) [rad].
        chains: the joints from the base to each sole, by their names.
    """

    def __init__(
        self, plant: MultibodyPlant, config: RobotConfig, soles: Mapping[Side, Frame], bent_knee: np.ndarray,
        q_index: np.ndarray,
    ) -> None:  # fmt: skip
        """
        Args:
            plant: finalized, with the robot alone. soles: frames of the soles.
            bent_knee: q (19,) with the torso upright. q_index: places of the twelve joints in it.
        """
        self.plant, self.config = plant, config
        self._soles, self._bent_knee, self._q_index = soles, bent_knee, q_index
        self.context = plant.CreateDefaultContext()
        self.set_joints(np.zeros(12))
        joints = [plant.GetJointByName(name) for name in config.joint_names]
        poses = [joint.frame_on_parent().CalcPoseInWorld(self.context) for joint in joints]
        self.origins = np.array([pose.translation() for pose in poses])
        turns = [pose.rotation() @ joint.revolute_axis() for pose, joint in zip(poses, joints, strict=True)]
        self.axes = np.array(turns)
        self.limits = np.array([[joint.position_lower_limit(), joint.position_upper_limit()] for joint in joints])
        self.bent = np.ravel([list(config.leg(side).bent_knee.model_dump().values()) for side in SIDES])
        self.chains = {side: chain_of(plant, soles[side].body()) for side in SIDES}

    def set_joints(self, angles: np.ndarray) -> None:
        """Sets the twelve angles [rad]; the torso stays upright."""
        q = self._bent_knee.copy()
        q[self._q_index] = angles
        self.plant.SetPositions(self.context, q)

    def sole(self, side: Side) -> np.ndarray:
        """Pose of a sole's frame, (3, 4) [m]."""
        pose: np.ndarray = self._soles[side].CalcPoseInWorld(self.context).GetAsMatrix34()
        return pose

    def leg(self, number: int) -> slice:
        """The joints of the left (0) or right (1) leg among the twelve."""
        return slice(6 * number, 6 * number + 6)

    def knee_ahead(self, number: int) -> float:
        """How far a bent knee points ahead: the x of sign(θ) (way from knee to ankle) × axis over its length."""
        knee = 6 * number + KNEE
        shank = self.origins[knee + 1] - self.origins[knee]
        ahead = np.cross(shank, self.axes[knee]) / max(float(np.linalg.norm(shank)), 1e-9)
        return float(np.sign(self.bent[knee]) * ahead[0])


def chain_of(plant: MultibodyPlant, body: Any) -> list[str]:
    """Names of the joints from the base to a body."""
    above = {}
    for joint in map(plant.get_joint, plant.GetJointIndices()):
        above[joint.child_body().index()] = joint
    names = list[str]()
    while body.index() in above:
        joint = above.pop(body.index())
        names.insert(0, joint.name())
        body = joint.parent_body()
    return names
