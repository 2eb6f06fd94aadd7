"""Roles of a leg's joints: which is hip yaw, roll and pitch, knee, ankle pitch and roll, by axes and places."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from pydrake.multibody.tree import Joint, RevoluteJoint
from scipy.optimize import linear_sum_assignment

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.importing.feet import Limb
from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.robot.parsing import listed
from pdhocbf_drake.robot.per_joint import ROLES

_LEAST = 0.7  # |cos| of the angle between a joint's axis and that of its role
_HIP, _ANKLE = ("hip_yaw", "hip_roll", "hip_pitch"), ("ankle_pitch", "ankle_roll")


class Axes(NamedTuple):
    """Directions of a robot that stands with all joints at zero, unit vectors in its base (3,)."""

    up: np.ndarray
    left: np.ndarray
    ahead: np.ndarray

    def of(self, role: str) -> np.ndarray:
        """The axis of a joint with that role."""
        return {"yaw": self.up, "roll": self.ahead, "pitch": self.left}[role.rpartition("_")[2]]


class Leg(NamedTuple):
    """A leg.

    Attributes:
        limb: its foot and all its moving joints. joints: by role.
        alignment: the least |cos| of the angle between a joint's axis and that of its role.
    """

    limb: Limb
    joints: dict[str, Joint]
    alignment: float

    def bends(self, model: ParsedModel, axes: Axes, role: str) -> float:
        """+1 where a positive angle turns the leg about the axis of its role, −1 where it turns against it."""
        return float(np.sign(model.axis(self.joints[role]) @ axes.of(role)))


def find_leg(model: ParsedModel, limb: Limb, axes: Axes, named: Sequence[str] | None = None) -> Leg:
    """The joints of a leg by role: of all six that follow each other in its chain, those whose axes fit best.

    The first three are the hip's and the last two the ankle's, each in any order. Among those that fit equally well,
    the ankle's two axes, and the hip's three, are those nearest to each other.

    Args:
        named: the names of the six in the order of `ROLES`; None for those to be found.

    Raises:
        ModelError: the leg has fewer than six joints, or no six of its joints fit.
    """
    if named is not None:
        return _named(model, limb, axes, named)
    revolute = [joint for joint in limb.joints if joint.type_name() == RevoluteJoint.kTypeName]
    if len(revolute) < len(ROLES):
        raise ModelError(f"a leg has six revolute joints, but the one to {limb.name} has {_described(model, limb)}")
    legs = (_assigned(model, limb, axes, six) for six in combinations(revolute, len(ROLES)))
    best = max(legs, key=lambda leg: (round(leg.alignment, 2), -_spread(model, leg)))
    if best.alignment < _LEAST:
        raise ModelError(
            f"no six joints of the leg to {limb.name} turn about the axes of a hip, a knee and an ankle: "
            f"{_described(model, limb)}; name them with --left-joints and --right-joints"
        )
    return best


def _assigned(model: ParsedModel, limb: Limb, axes: Axes, six: Sequence[Joint]) -> Leg:
    fits = np.array([[abs(model.axis(joint) @ axes.of(role)) for role in ROLES] for joint in six])
    joints, worst = {"knee_pitch": six[3]}, fits[3, ROLES.index("knee_pitch")]
    for first, roles in ((0, _HIP), (4, _ANKLE)):
        columns = [ROLES.index(role) for role in roles]
        part = fits[first : first + len(roles), columns]
        rows, chosen = linear_sum_assignment(-part)
        joints |= {roles[column]: six[first + row] for row, column in zip(rows, chosen, strict=True)}
        worst = min(worst, part[rows, chosen].min())
    return Leg(limb, {role: joints[role] for role in ROLES}, float(worst))


def _spread(model: ParsedModel, leg: Leg) -> float:
    """Lengths between the joints of the hip and between those of the ankle, less those of thigh and shank [m]."""
    places = {role: model.place(joint) for role, joint in leg.joints.items()}

    def length(one: str, other: str) -> float:
        return float(np.linalg.norm(places[one] - places[other]))

    hip = length("hip_yaw", "hip_roll") + length("hip_roll", "hip_pitch") + length("hip_yaw", "hip_pitch")
    thigh, shank = length("hip_pitch", "knee_pitch"), length("knee_pitch", "ankle_pitch")
    return hip + length("ankle_pitch", "ankle_roll") - min(thigh, shank)


def _named(model: ParsedModel, limb: Limb, axes: Axes, names: Sequence[str]) -> Leg:
    there = {joint.name(): joint for joint in limb.joints}
    missing = [name for name in names if name not in there]
    if missing or len(set(names)) != len(ROLES):
        raise ModelError(
            f"six joints are needed, {', '.join(ROLES)}; given: {', '.join(names)}; "
            f"the joints to {limb.name} are {listed(there)}"
        )
    joints = {role: there[name] for role, name in zip(ROLES, names, strict=True)}
    alignment = min(abs(float(model.axis(joint) @ axes.of(role))) for role, joint in joints.items())
    return Leg(limb, joints, alignment)


def _described(model: ParsedModel, limb: Limb) -> str:
    """The joints of a limb with their axes, from the base on."""
    texts = (
        f"{joint.name()} [{' '.join(f'{x + 0.0:.2g}' for x in model.axis(joint).round(2))}]" for joint in limb.joints
    )
    return f"{len(limb.joints)}: {', '.join(texts)}" if limb.joints else "none"
