"""The default stride and duration of a step: what legs, joints and soles allow."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.fitting.facts import PACKAGED
from pdhocbf_drake.fitting.preview import Preview, Step, preview, zmp_shift
from pdhocbf_drake.robot import Biped, longest_stride, sole_pose, swing_lever, upright_posture
from pdhocbf_drake.robot.leg import axis_of
from pdhocbf_drake.walking.com_height import GRAVITY
from pdhocbf_drake.walking.config import GaitConfig

SHIFT, LARGEST_SHIFT = 0.6, 0.9
"""How far the swing leg may move the ZMP, over half the sole's length: by default, and before a step is stretched."""

_STEP = GaitConfig()
BOX = _STEP.zmp_box[0] / (2.0 * PACKAGED.sole[0])
"""Half the length of the ZMP box, as it is written for the packaged robot, over that of its sole."""

_DRIFT = 0.225
"""(ω T)² times how far the swing leg of the packaged robot moves the ZMP, over the length of its legs; the most of its
scenarios, whose CoM is lowest on stairs."""

_REACH = 0.5  # of the longest step that the legs can stand in
_SPEED = 0.8  # of the joints' limits
_TORQUE = 0.9  # of an ankle's
_SLOWER = 1.5  # longest step over that of the size of the legs; from there on the stride gets shorter
_SHORTER = 0.9  # factor of the stride in one attempt
_ATTEMPTS = 12
_FEWEST_TICKS = 25  # of a step; with fewer, a robot of 0.3 of the packaged one's size keeps a barrier's bound barely


class FittedStep(NamedTuple):
    """A step that suits a robot.

    Attributes:
        stride: [m]. tick: δ [s]. ticks: of a step.
        box: half the length of a ZMP box over that of the sole, for as far as the swing leg moves the ZMP in the
            robot's own step, and the ankles hold it; 0 where the robot can't stand.
        pull: by how much more than that of the packaged robot, for the size of both, the swing leg drives the CoM off
            the pendulum's orbit, see `_Wanted.pull`; 1 for a robot of which it is less in its own step.
        reasons: a sentence for each limit that has changed it.
    """

    stride: float
    tick: float
    ticks: int
    box: float
    pull: float
    reasons: tuple[str, ...]


def fitted_step(biped: Biped, gait: dict[str, Any], given: dict[str, Any], length: float) -> FittedStep:
    """The stride, tick and ticks of a step.

    Args:
        gait: the keys of `gait` with their default values.
        given: those that the user has given, which stay as they are.
        length: of the legs over those of the packaged robot.
    """
    own = _rounded((_STEP.stride if "stride" in given else gait["stride"]) * length)
    tick, usual = gait["tick"], gait["ticks_per_step"] * gait["tick"]
    if "ticks_per_step" not in given:
        usual = _STEP.ticks_per_step * _STEP.tick * math.sqrt(length)
        while "tick" not in given and usual / tick < _FEWEST_TICKS:
            tick /= 2.0
    step = gait if {"double_support_ticks", "ticks_per_step"} <= given.keys() else _STEP.model_dump()
    share = 1.0 - step["double_support_ticks"] / step["ticks_per_step"]
    wanted = _Wanted(biped, gait, length, share)
    duration, why = usual, ""
    if "ticks_per_step" not in given:
        duration, why = wanted.duration(own, usual, SHIFT)
    stride, shorter = wanted.stride(own, duration)
    box, pull = wanted.box(stride, duration), wanted.pull(stride, duration)
    if "stride" in given:
        stride, shorter = gait["stride"], ""
        if "ticks_per_step" not in given:
            duration, why = wanted.duration_of(stride, own, usual)
    pull = max(pull, wanted.pull(stride, duration)) if pull > 1.0 else 1.0
    ticks = round(duration / tick) if duration == usual else math.ceil(duration / tick - 1e-9)
    return FittedStep(stride, tick, ticks, box, pull, tuple(reason for reason in (why, shorter) if reason))


class _Wanted:
    """What limits a robot's steps; where it can't even stand, nothing does, and the walk is refused later."""

    def __init__(self, biped: Biped, gait: dict[str, Any], length: float, share: float) -> None:
        self._biped, self._share, self._leg = biped, share, length * PACKAGED.leg
        self._width, self._height = gait["stance_width"], gait["com_height"]
        self._swing_height = gait["swing_height"] * length
        self._highest = self._height + gait["com_height_amplitude"] * length
        self._half = min(float(sole.half_size[0]) for sole in biped.soles.values())
        com, half = np.array([0.0, 0.0, self._height]), self._width / 2.0
        try:
            posture = upright_posture(biped, com, sole_pose(0.0, half), sole_pose(0.0, -half))
            self._lever = float(swing_lever(biped, posture)[0])
            self._ankles = _ankle_reach(biped, posture)
        except ModelError:
            self._lever, self._ankles = math.nan, 0.0

    def shift(self, stride: float, duration: float) -> float:
        """How far the swing leg moves the ZMP at most, over half the sole's length."""
        return zmp_shift(self._lever, stride, duration * self._share) / self._half

    def box(self, stride: float, duration: float) -> float:
        """Half the length of a ZMP box over that of the sole; 0 where the robot can't stand."""
        if math.isnan(self._lever):
            return 0.0
        return min(max(self.shift(stride, duration), BOX), max(self._ankles / self._half, BOX / 2.0))

    def pull(self, stride: float, duration: float) -> float:
        """How far the swing leg drives the CoM off the pendulum's orbit, over what it does in the packaged robot.

        A ZMP that goes to and fro by s in a step of T drives the CoM's velocity by some ω² s T, and its position by
        (ω T)² s, counted in legs' lengths. More than its box holds it drives in proportion to what the box holds.
        """
        shift, swings = self.shift(stride, duration), GRAVITY / self._height * duration**2
        return max(shift / BOX, swings * shift * self._half / self._leg / _DRIFT)

    def speed(self, stride: float, duration: float) -> float:
        """The largest joint speed over its limit; 0 where the step is out of reach."""
        found = self._preview(stride, duration)
        return 0.0 if found.missed else float((found.speeds / self._biped.velocity_limits).max())

    def _preview(self, stride: float, duration: float) -> Preview:
        step = Step(stride, self._width, self._height, self._swing_height, duration, duration * self._share)
        return preview(self._biped, step)

    def duration(self, stride: float, usual: float, most: float) -> tuple[float, str]:
        """The shortest step, from the usual one on, that soles and joints allow, with the reason; it may not do."""
        shift, speed = self.shift(stride, usual), self.speed(stride, usual)
        longer = max(math.sqrt(shift / most), speed / _SPEED)
        if not longer > 1.0:
            return usual, ""
        why = "the swing leg's pull on the ZMP" if math.sqrt(shift / most) >= speed / _SPEED else "the joints' speed"
        # A share of the way is enough: of the default stride more would make a slow walk.
        duration = usual * (min(longer, _SLOWER) if most == SHIFT else longer)
        return duration, f"steps of {duration:.3g} s instead of {usual:.3g} s for {why}"

    def duration_of(self, stride: float, own: float, usual: float) -> tuple[float, str]:
        """That of a stride which the user has given: beyond the robot's own one no shorter than that takes."""
        if abs(stride) <= own:
            return self.duration(stride, usual, SHIFT)
        return max(self.duration(own, usual, SHIFT), self.duration(stride, usual, LARGEST_SHIFT))

    def stride(self, stride: float, duration: float) -> tuple[float, str]:
        """The longest stride up to the default one that legs, soles and joints allow, with the reason."""
        first, why = stride, ""
        if math.isnan(self._lever) or not stride:
            return stride, ""
        reach = _REACH * longest_stride(self._biped, self._width, self._highest)
        if abs(stride) > reach:
            stride, why = math.copysign(reach, stride), "the legs' reach"
        if self._preview(stride, duration).missed and not self._preview(0.0, duration).missed:
            why = "the joints' stops"
            while self._preview(stride, duration).missed and abs(stride) > _SHORTER**_ATTEMPTS * abs(first):
                stride *= _SHORTER
        for _ in range(_ATTEMPTS):
            if self.shift(stride, duration) <= SHIFT * 1.01 and self.speed(stride, duration) <= _SPEED * 1.01:
                break
            stride, why = stride * _SHORTER, "the swing leg's pull on the ZMP and the joints' speed"
        if stride == first:
            return stride, ""
        return _rounded(stride), f"a stride of {stride:.3g} m instead of {first:.3g} m for {why}"


def _ankle_reach(biped: Biped, posture: np.ndarray) -> float:
    """How far from the middle of its sole the ankle pitch of the weaker leg holds the ZMP under all of the weight [m].

    A ZMP ahead of the ankle's axis by d takes the torque m g d.
    """
    context = biped.plant.CreateDefaultContext()
    biped.plant.SetPositions(context, posture)
    weight = biped.mass * GRAVITY
    reaches = []
    for number in (4, 10):
        ankle = axis_of(biped, context, biped.joint_names[number])[0][0]  # the soles are at x = 0
        reaches.append(_TORQUE * float(biped.effort_limits[number]) / weight - abs(float(ankle)))
    return min(reaches)


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
