"""What a user writes about a robot: the model file, its names, its soles and its gains."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pdhocbf_drake.config import Config

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
ROLES = ("hip_yaw", "hip_roll", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_roll")


class SoleConfig(Config):
    """Where a sole is: a rectangle on the ground, x forward, z up, seen from a link or frame of the model.

    Attributes:
        link: foot link (or any frame) of the model.
        xyz: centre of the sole in that frame [m].
        rpy: orientation of the sole in that frame, roll-pitch-yaw [rad].
        half_size: half length and half width of the rectangle [m].
    """

    link: str
    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    half_size: tuple[float, float]


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

    hip_yaw: float = 0.0
    hip_roll: float = 0.0
    hip_pitch: float = 0.0
    knee_pitch: float = 0.0
    ankle_pitch: float = 0.0
    ankle_roll: float = 0.0


class LegConfig(Config):
    """A leg.

    Attributes:
        sole: where its sole is.
        joints: names of its joints.
        bent_knee: a posture with the knee clearly bent, from which inverse kinematics starts.
    """

    sole: SoleConfig
    joints: LegJoints
    bent_knee: LegAngles


PerRole = float | tuple[float, float, float, float, float, float]


class RobotConfig(Config):
    """A walking robot as data.

    Per-joint values are one number for all joints, or six in the order hip yaw, roll, pitch, knee pitch,
    ankle pitch, roll, the same for both legs.

    Attributes:
        name: what to call it in messages, logs and plots.
        model: URDF, SDF or MJCF file, relative to this YAML file.
        packages: `package://` names that the model uses, each with its folder, relative to this YAML file.
        base_link: the floating link.
        torso_link: the link or frame that is kept upright; null takes the base.
        left, right: the legs.
        fixed_joints: further joints of the model (arms, neck), welded at these angles [rad].
        com_height: CoM height above the soles at which the robot stands and walks [m].
        stance_width: lateral distance between the soles' centres [m].
        kp: proportional gains of the joints [N m/rad].
        kd: derivative gains of the joints [N m s/rad].
        effort_limits: greatest joint torques [N m]; null takes the model's. Where the model has no actuators,
            they are added with these limits.
        reflected_inertia: rotor inertia seen at the joint [kg m²]; null takes the model's.
    """

    name: str
    model: str
    packages: dict[str, str] = Field(default_factory=dict)
    base_link: str
    torso_link: str | None = None
    left: LegConfig
    right: LegConfig
    fixed_joints: dict[str, float] = Field(default_factory=dict)
    com_height: float = Field(gt=0)
    stance_width: float = Field(gt=0)
    kp: PerRole = 600.0
    kd: PerRole = 20.0
    effort_limits: PerRole | None = None
    reflected_inertia: PerRole | None = None

    def leg(self, side: Side) -> LegConfig:
        """The leg of that side."""
        return self.left if side == "left" else self.right

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The model's names of the twelve joints: left leg, then right, each in the order of `ROLES`."""
        return tuple(getattr(self.leg(side).joints, role) for side in SIDES for role in ROLES)
