"""Config of a robot: model file, names of links and joints, soles, gains and limits."""

from __future__ import annotations

import math
from collections import Counter
from typing import Annotated, Literal

from pydantic import Field, model_validator

from pdhocbf_drake.config import Config, Length, within
from pdhocbf_drake.robot.per_joint import ROLES, PerJoint, per_joint_within

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
Angle = Annotated[float, within(-math.pi, math.pi, "rad")]
Place = Annotated[float, within(-10.0, 10.0, "m")]
HalfSide = Annotated[float, within(0.0, 1.0, "m", above=True)]


class SoleConfig(Config):
    """A sole, a rectangle with x forward and z up, in a link or frame of the model.

    Attributes:
        link: foot link (or any frame) of the model.
        xyz: centre of the sole in that frame [m].
        rpy: orientation of the sole in that frame, roll-pitch-yaw [rad].
        half_size: half length and half width of the rectangle [m].
    """

    link: str
    xyz: tuple[Place, Place, Place] = (0.0, 0.0, 0.0)
    rpy: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    half_size: tuple[HalfSide, HalfSide]


class LegJoints(Config):
    """The model's names of the six joints of a leg, whatever their order along the chain."""

    hip_yaw: str
    hip_roll: str
    hip_pitch: str
    knee_pitch: str
    ankle_pitch: str
    ankle_roll: str


class LegAngles(Config):
    """Joint angles of a leg [rad], in the signs of the model."""

    hip_yaw: Angle = 0.0
    hip_roll: Angle = 0.0
    hip_pitch: Angle = 0.0
    knee_pitch: Angle = 0.0
    ankle_pitch: Angle = 0.0
    ankle_roll: Angle = 0.0


class LegConfig(Config):
    """A leg.

    Attributes:
        sole: its sole.
        joints: names of its joints.
        bent_knee: joint angles with the knee clearly bent, from which inverse kinematics starts.
    """

    sole: SoleConfig
    joints: LegJoints
    bent_knee: LegAngles


class RobotConfig(Config):
    """A walking robot as data.

    Per-joint values are one number for all joints, or six in the order hip yaw, roll, pitch, knee pitch,
    ankle pitch, roll, the same for both legs; or a map of `left` and `right` to such values.

    Attributes:
        name: its name in messages, logs and plots.
        model: URDF, SDF or MJCF file, relative to this YAML file.
        packages: folders of the `package://` names in the model, relative to this YAML file.
        base_link: the floating link.
        torso_link: the link or frame that is kept upright; null takes the base.
        torso_rpy: orientation, in that link or frame, of the axes that are kept upright, x ahead and z up,
            roll-pitch-yaw [rad]; (0, 0, 3.14159) for one whose own x points backwards.
        left, right: the legs.
        fixed_joints: further joints of the model (waist, arms, neck), welded at these angles or lengths [rad, m].
        keep_contact: whether the feet touch the ground with the model's own geometry; otherwise with four small
            spheres at the corners of the sole.
        com_height: CoM height above the soles at which the robot stands and walks [m].
        stance_width: lateral distance between the soles' centres [m].
        kp: proportional gains of the joints; null takes 3.64 m g z, z the CoM height [N m/rad].
        kd: derivative gains of the joints; null takes kp times 0.137 √(z/g) [N m s/rad].
        effort_limits: greatest joint torques [N m]; null takes those of the model's actuators, or where it has none,
            of its `<limit>` tags.
        velocity_limits: greatest joint speeds; null takes the model's [rad/s].
        reflected_inertia: rotor inertia reflected to the joint [kg m²]; null takes the model's.
    """

    name: str
    model: str
    packages: dict[str, str] = Field(default_factory=dict)
    base_link: str
    torso_link: str | None = None
    torso_rpy: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    left: LegConfig
    right: LegConfig
    keep_contact: bool = False
    fixed_joints: dict[str, float] = Field(default_factory=dict)
    com_height: Length
    stance_width: Length
    kp: Annotated[PerJoint | None, per_joint_within(0.0, 1e6, "N m/rad", above=True)] = None
    kd: Annotated[PerJoint | None, per_joint_within(0.0, 1e5, "N m s/rad")] = None
    effort_limits: Annotated[PerJoint | None, per_joint_within(0.0, 1e6, "N m", above=True)] = None
    velocity_limits: Annotated[PerJoint | None, per_joint_within(0.0, 1e4, "rad/s", above=True)] = None
    reflected_inertia: Annotated[PerJoint | None, per_joint_within(0.0, 1e3, "kg m²")] = None

    @model_validator(mode="after")
    def _check_names(self) -> RobotConfig:
        """Raises `ValueError` for a joint or sole that is named twice."""
        twice = [name for name, count in Counter(self.joint_names).items() if count > 1]
        if twice:
            sides = [(side, self.leg(side).joints.model_dump()) for side in SIDES]
            places = [f"{side}.joints.{role}" for side, joints in sides for role in ROLES if joints[role] == twice[0]]
            raise ValueError(f"joint {twice[0]!r} is named for {' and '.join(places)}; each has a joint of its own")
        fixed = [name for name in self.joint_names if name in self.fixed_joints]
        if fixed:
            raise ValueError(f"joint {fixed[0]!r} is in fixed_joints, and a joint of a leg too")
        return self

    def leg(self, side: Side) -> LegConfig:
        """The leg of that side."""
        return self.left if side == "left" else self.right

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The model's names of the twelve joints: left leg, then right, each in the order of `ROLES`."""
        return tuple(getattr(self.leg(side).joints, role) for side in SIDES for role in ROLES)
