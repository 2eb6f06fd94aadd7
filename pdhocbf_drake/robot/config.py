"""Config of a robot: model file, names of links and joints, soles, gains and limits."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, WrapValidator

from pdhocbf_drake.config import Config, Length, limited, within

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
Angle = Annotated[float, within(-math.pi, math.pi, "rad")]
Place = Annotated[float, within(-10.0, 10.0, "m")]
HalfSide = Annotated[float, within(0.0, 1.0, "m", above=True)]
ROLES = ("hip_yaw", "hip_roll", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_roll")


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


def _one_or_six(low: float, high: float, unit: str, *, above: bool = False) -> WrapValidator:
    """Checks each number of a per-joint value; the error is one sentence."""
    allowed = limited(low, high, unit, above=above)

    def check(value: Any, parse: Callable[[Any], Any]) -> Any:
        try:
            parsed = parse(tuple(value) if isinstance(value, list) else value)
        except ValidationError:
            raise ValueError("must be one number for all joints, or six: " + ", ".join(ROLES)) from None
        for number in parsed if isinstance(parsed, tuple) else (parsed,):
            if number is not None:
                allowed(number)
        return parsed

    return WrapValidator(check)


_PerRole = float | tuple[float, float, float, float, float, float]


class RobotConfig(Config):
    """A walking robot as data.

    Per-joint values are one number for all joints, or six in the order hip yaw, roll, pitch, knee pitch,
    ankle pitch, roll, the same for both legs.

    Attributes:
        name: its name in messages, logs and plots.
        model: URDF, SDF or MJCF file, relative to this YAML file.
        packages: folders of the `package://` names in the model, relative to this YAML file.
        base_link: the floating link.
        torso_link: the link or frame that is kept upright; null takes the base.
        left, right: the legs.
        fixed_joints: further joints of the model (arms, neck), welded at these angles [rad].
        com_height: CoM height above the soles at which the robot stands and walks [m].
        stance_width: lateral distance between the soles' centres [m].
        kp: proportional gains of the joints; null takes 3.64 m g z, z the CoM height [N m/rad].
        kd: derivative gains of the joints; null takes kp times 0.137 √(z/g) [N m s/rad].
        effort_limits: greatest joint torques [N m]; null takes the model's. Where the model has no actuators,
            they are added with these limits.
        reflected_inertia: rotor inertia reflected to the joint [kg m²]; null takes the model's.
    """

    name: str
    model: str
    packages: dict[str, str] = Field(default_factory=dict)
    base_link: str
    torso_link: str | None = None
    left: LegConfig
    right: LegConfig
    fixed_joints: dict[str, float] = Field(default_factory=dict)
    com_height: Length
    stance_width: Length
    kp: Annotated[_PerRole | None, _one_or_six(0.0, 1e6, "N m/rad", above=True)] = None
    kd: Annotated[_PerRole | None, _one_or_six(0.0, 1e5, "N m s/rad")] = None
    effort_limits: Annotated[_PerRole | None, _one_or_six(0.0, 1e6, "N m", above=True)] = None
    reflected_inertia: Annotated[_PerRole | None, _one_or_six(0.0, 1e3, "kg m²")] = None

    def leg(self, side: Side) -> LegConfig:
        """The leg of that side."""
        return self.left if side == "left" else self.right

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The model's names of the twelve joints: left leg, then right, each in the order of `ROLES`."""
        return tuple(getattr(self.leg(side).joints, role) for side in SIDES for role in ROLES)
