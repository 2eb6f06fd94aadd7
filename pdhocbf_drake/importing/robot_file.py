"""The robot file and the scenario of an imported model."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from pydrake.math import RollPitchYaw, RotationMatrix
from pydrake.multibody.tree import Joint

from pdhocbf_drake.importing.inferred import Inferred
from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.importing.roles import Axes, Leg
from pdhocbf_drake.importing.soles import SoleFound
from pdhocbf_drake.robot.config import SIDES

_BENT = {"hip_pitch": -0.4, "knee_pitch": 0.8, "ankle_pitch": -0.4}  # about the axis to the left [rad]
_NARROWEST = 4.0 / 3.0  # of the feet's lateral distance, as a share of a sole's width: that of the packaged biped
_WIDEST = 0.5  # likewise, as a share of the leg: over wider feet the CoM sways faster than the ZMP can follow
_INERTIA = 9.6e-4  # reflected inertia / (m L²), for models that say nothing of their rotors


class Legs(NamedTuple):
    """Both legs with their soles, left then right; thigh and shank together are `length` long [m]."""

    legs: tuple[Leg, Leg]
    soles: tuple[SoleFound, SoleFound]
    axes: Axes
    length: float

    def joints(self) -> list[Joint]:
        """The twelve."""
        return [joint for leg in self.legs for joint in leg.joints.values()]


def leg_length(model: ParsedModel, leg: Leg) -> float:
    """Length of thigh and shank, from hip pitch over knee to ankle pitch [m]."""
    hip, knee, ankle = (model.place(leg.joints[role]) for role in _BENT)
    return float(np.linalg.norm(hip - knee) + np.linalg.norm(knee - ankle))


def stance_width(model: ParsedModel, found: Legs) -> Inferred:
    """Lateral distance of the soles' centres with all joints at zero, within what their width and the legs need."""
    centres = [model.plant.EvalBodyPoseInWorld(model.context, s.link) @ s.pose.translation() for s in found.soles]
    apart = float(abs((centres[0] - centres[1]) @ found.axes.left))
    least = _NARROWEST * 2.0 * float(max(sole.half_size[1] for sole in found.soles))
    value, source = max(
        min((apart, "distance of the soles with all joints at zero"), (_WIDEST * found.length, "length of the legs")),
        (least, "width of the soles"),
    )
    return Inferred("stance width", f"{value:.3f} m", source, "likely")


def robot_entries(
    name: str, file: str, model: ParsedModel, found: Legs, width: float, fixed: dict[str, float]
) -> dict[str, Any]:
    """The robot file without its CoM height."""
    entries: dict[str, Any] = {"name": name, "model": file, "base_link": model.base.name()}
    axes = np.column_stack([found.axes.ahead, found.axes.left, found.axes.up])
    angles = np.round(RollPitchYaw(RotationMatrix(axes)).vector(), 9) + 0.0
    if angles.any():
        entries["torso_rpy"] = np.clip(angles, -math.pi, math.pi).tolist()
    entries["stance_width"] = width
    for side, leg, sole in zip(SIDES, found.legs, found.soles, strict=True):
        bends = {role: round(angle * leg.bends(model, found.axes, role), 3) for role, angle in _BENT.items()}
        entries[side] = {
            "sole": sole.entries,
            "joints": {role: joint.name() for role, joint in leg.joints.items()},
            "bent_knee": bends,
        }
    if fixed:
        entries["fixed_joints"] = fixed
    return entries


def reflected_inertia(mass: float, length: float) -> float:
    """A reflected inertia in proportion to m L² [kg m²]."""
    return float(f"{_INERTIA * mass * length**2:.2g}")
