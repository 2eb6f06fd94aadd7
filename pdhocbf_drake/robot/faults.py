"""Wrong entries of a robot file, found from the model's geometry: sides, facing, roles of joints, bent knees, soles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.config import SIDES, Side
from pdhocbf_drake.robot.per_joint import ROLES
from pdhocbf_drake.robot.straight_pose import KNEE, StraightPose

_HIP, _ANKLE = slice(0, 3), slice(4, 6)  # of the joints of a leg, in the order of `ROLES`
_AXES = {"hip_yaw": 2, "hip_roll": 0, "hip_pitch": 1, "knee_pitch": 1, "ankle_pitch": 1, "ankle_roll": 0}
_WORDS = ("the axis ahead (roll)", "the axis to the left (pitch)", "the vertical (yaw)")
_BETTER = 0.5  # in the sum of |cosines| of the axes, by which another assignment of roles must be better
_LEVEL = 0.5  # [rad]: a sole that is pitched by more in the bent-knee posture has a joint of the wrong sign
_STRAIGHT = 0.05  # [rad]: a knee that is bent by less
_AHEAD = 0.7  # least cosine of a sole's axes with those of the torso
_ROUNDING = 1e-6  # [rad]


class Fault(NamedTuple):
    """What is wrong with an entry of a robot file.

    Attributes:
        key: the entry. said: what is wrong. fix: what to do.
        fatal: whether the robot can't be used like that; otherwise it may walk all the same.
    """

    key: str
    said: str
    fix: str
    fatal: bool = True

    def __str__(self) -> str:
        return f"{self.key}: {self.said}; {self.fix}"


def faults_in(look: StraightPose) -> list[Fault]:
    """The faults of a robot file. One that explains others, such as a torso that faces backwards, is the only one."""
    for check in (_chains, _upright, _facing, _roles, _bent_knees, _soles):
        if faults := list(check(look)):
            return faults
    return []


def _chains(look: StraightPose) -> Iterator[Fault]:
    """Each sole is at the end of its own leg's joints, which come as hip, knee, ankle."""
    joints = {side: look.config.joint_names[6 * i : 6 * i + 6] for i, side in enumerate(SIDES)}
    for side, other in (SIDES, SIDES[::-1]):
        missing = [name for name in joints[side] if name not in look.chains[side]]
        if not missing:
            continue
        link = look.config.leg(side).sole.link
        crossed = set(joints[side]) <= set(look.chains[other])
        yield Fault(
            f"{side}.sole.link", f"{link!r} is not moved by joint {missing[0]!r} of {side}.joints",
            "exchange left.joints and right.joints, or the soles' links" if crossed else "name a link of that foot",
        )  # fmt: skip
        return
    for side in SIDES:
        places = [look.chains[side].index(name) for name in joints[side]]
        if not max(places[_HIP]) < places[KNEE] < min(places[_ANKLE]):
            order = ", ".join(name for name in look.chains[side] if name in joints[side])
            knee = joints[side][KNEE]
            yield Fault(
                f"{side}.joints", f"the knee, {knee!r}, must come after the hip's joints and before the ankle's",
                f"along the leg they come as {order}",
            )  # fmt: skip


def _upright(look: StraightPose) -> Iterator[Fault]:
    """The legs hang down from the torso, and the knees turn about its y axis."""
    legs = [look.origins[6 * i + KNEE + 1] - look.origins[6 * i + 2] for i in (0, 1)]
    down = sum(leg / max(float(np.linalg.norm(leg)), 1e-9) for leg in legs) / 2.0
    knees = np.abs(look.axes[[KNEE, 6 + KNEE]]).mean(axis=0)
    said = ""
    if -down[2] < _AHEAD:
        said = "the legs don't hang down along the torso's z axis"
    elif knees[0] > _AHEAD:
        said = "the torso's x axis points sideways: both knees turn about it"
    if said:
        turn = "turn the torso's axes with torso_rpy, so that x is ahead and z is up, or name another torso_link"
        yield Fault("torso_rpy", said, turn)


def _facing(look: StraightPose) -> Iterator[Fault]:
    """Left is where y is greater; forward, which is where the knees bend to, is x."""
    left, right = (float(look.sole(side)[1, 3]) for side in SIDES)
    ahead = [look.knee_ahead(number) for number in (0, 1)]
    if left > right:
        return
    where = f"the left sole is at y = {left:.3g} m and the right one at {right:.3g} m"
    if max(ahead) < 0.0:
        yield Fault(
            "torso_rpy", f"the torso faces backwards: the knees bend towards its −x, and {where}",
            "turn its axes with torso_rpy: [0.0, 0.0, 3.14159]",
        )  # fmt: skip
    else:
        yield Fault(
            "left, right", f"left and right are exchanged: {where}, but left is where y is greater (x is forward)",
            "exchange the two entries",
        )  # fmt: skip


def _roles(look: StraightPose) -> Iterator[Fault]:
    """The axes of hip and ankle joints are those of their roles, or nearer to them than to any others."""
    for number, side in enumerate(SIDES):
        for part in (_HIP, _ANKLE):
            roles, axes = ROLES[part], np.abs(look.axes[look.leg(number)][part])
            yield from _exchanged(side, roles, look.config.joint_names[look.leg(number)][part], axes)


def _exchanged(side: Side, roles: Sequence[str], names: Sequence[str], axes: np.ndarray) -> Iterator[Fault]:
    def fit(order: Sequence[int]) -> float:
        return sum(float(axes[i, _AXES[roles[place]]]) for i, place in enumerate(order))

    given = tuple(range(len(roles)))
    best = max(permutations(given), key=fit)
    if fit(best) < fit(given) + _BETTER:
        return
    for i, place in enumerate(best):
        if i != place:
            word = _WORDS[int(axes[i].argmax())]
            yield Fault(f"{side}.joints.{roles[i]}", f"{names[i]!r} turns about {word}", f"it is the {roles[place]}")


def _bent_knees(look: StraightPose) -> Iterator[Fault]:
    """Bent-knee angles are within the joints' limits, bend the knees forward and leave the soles level."""
    for number, side in enumerate(SIDES):
        knee = 6 * number + KNEE
        low, high = look.limits[knee]
        angle, other = look.bent[knee], -look.bent[knee]
        backwards, possible = look.knee_ahead(number) < 0.0, low - _ROUNDING <= other <= high + _ROUNDING
        if backwards and possible:
            yield Fault(
                f"{side}.bent_knee.knee_pitch", f"{angle:g} rad bends the knee backwards",
                f"it bends forward with {other:g}; turn the signs of the leg's other angles too where they are wrong",
            )  # fmt: skip
            continue
        for joint, role in zip(range(12)[look.leg(number)], ROLES, strict=True):
            low, high = look.limits[joint]
            if not low - _ROUNDING <= look.bent[joint] <= high + _ROUNDING:
                said = f"{look.bent[joint]:g} rad is beyond the joint's limits, {low:.3g} to {high:.3g} rad"
                turned = low - _ROUNDING <= -look.bent[joint] <= high + _ROUNDING
                yield Fault(f"{side}.bent_knee.{role}", said, "turn its sign" if turned else "give one within them")
        if backwards:
            yield Fault(
                f"{side}.bent_knee.knee_pitch", "the joint's limits let the knee bend backwards only",
                "if the robot's front is there, turn torso_rpy by 3.14159 about z and exchange left and right", False,
            )  # fmt: skip
        if abs(angle) < _STRAIGHT:
            said = f"{angle:g} rad leaves the knee straight, so that it may bend either way"
            yield Fault(f"{side}.bent_knee.knee_pitch", said, "give the angle of a knee that bends forward")
        yield from _not_level(look, number, side)


def _not_level(look: StraightPose, number: int, side: Side) -> Iterator[Fault]:
    def tilt(angles: np.ndarray) -> float:
        look.set_joints(angles)
        return float(np.arccos(np.clip(look.sole(side)[2, 2], -1.0, 1.0)))

    here = tilt(look.bent)
    if here <= _LEVEL:
        return
    if here >= np.pi - _LEVEL:  # which no sign of a joint makes of a sole that is level
        yield Fault(f"{side}.sole.rpy", "the sole's z axis points down", "turn its roll by 3.14159 rad, or its pitch")
        return
    turned = {}
    for place, role in enumerate(ROLES):
        angles = look.bent.copy()
        angles[6 * number + place] *= -1.0
        turned[role] = tilt(angles)
    best = min(turned, key=turned.__getitem__)
    said = f"with these angles the sole is tilted by {np.degrees(here):.0f}°"
    hint = f"with {best} of the other sign by {np.degrees(turned[best]):.0f}°"
    yield Fault(
        f"{side}.bent_knee", said, hint if turned[best] < here / 2.0 else "give angles that leave it level", False
    )


def _soles(look: StraightPose) -> Iterator[Fault]:
    """A sole's x is ahead and its z is up."""
    look.set_joints(look.bent)
    for side in SIDES:
        pose = look.sole(side)
        if pose[2, 2] < _AHEAD:
            yield Fault(f"{side}.sole.rpy", "the sole's z axis does not point up", "turn the sole's frame")
        elif pose[0, 0] < _AHEAD:
            yaw = np.arctan2(pose[1, 0], pose[0, 0])
            said = f"the sole's x axis points {np.degrees(yaw):.0f}° to the left of ahead"
            yield Fault(f"{side}.sole.rpy", said, f"turn its yaw by {-yaw:.4g} rad")
