"""The CoM height at which a robot can walk, and the longest step there, from a scan of its reach."""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.fitting.facts import PACKAGED
from pdhocbf_drake.fitting.preview import Step, preview
from pdhocbf_drake.importing.inferred import Inferred
from pdhocbf_drake.robot import ROLES, Biped, longest_stride
from pdhocbf_drake.robot.reach import reachable_heights, reaches
from pdhocbf_drake.walking.config import GaitConfig

_BEND = 0.091  # by which the CoM is below its highest place, as a share of the leg: knees bent by 54°, as ours
_AMPLITUDE = 1.0 / 60.0  # of the CoM's height in a walk, as a share of the leg
_STRIDE = 0.25  # of a walk, as a share of the leg
_SPARE = 1.1
_LOAD = 0.9  # share of a joint's torque in a step
_LEAST_BEND = 0.045  # as _BEND, where that asks too much of hips and knees
_HEIGHTS = 5  # that are tried


def com_height(biped: Biped, leg: float, width: float) -> tuple[float, float, list[Inferred]]:
    """The CoM height with the knees well bent, and the longest step there [m].

    Where the legs are too stiff for a usual stride at that height, it is the height of the longest step; where hips and
    knees lack the torque, it is as much higher, with straighter knees, as that takes.

    Args:
        biped: the robot. leg: length of thigh and shank [m]. width: lateral distance of the feet [m].

    Raises:
        ModelError: the robot can't stand at any height.
    """
    grid = leg / 60.0
    band = reachable_heights(biped, width)
    if len(band) == 0:
        raise ModelError("the robot can't stand on both feet at any height; is a joint's role or limit wrong?")
    low, high = (_end(biped, width, float(inside), step) for inside, step in ((band[0], -grid), (band[-1], grid)))
    height = max(high - _BEND * leg, 0.5 * (low + min(high, low + 2.0 * _AMPLITUDE * leg)))
    longest = _longest_step(biped, leg, width, height)
    if longest < _SPARE * _STRIDE * leg:
        tried = np.linspace(low, high, 12)[1:-1]
        steps = [_longest_step(biped, leg, width, float(other)) for other in tried]
        if max(steps) > longest:
            longest, height = max(steps), float(tried[int(np.argmax(steps))])
    text = f"in reach with level feet are {low:.3g} to {high:.3g} m"
    lighter = _lighter(biped, leg, width, height, high - _LEAST_BEND * leg)
    if lighter > height:
        height, longest = lighter, _longest_step(biped, leg, width, lighter)
        text += "; further down a usual step is out of reach, or too much for hips and knees"
    height = float(np.round(height, 3))
    return (
        height,
        longest,
        [
            Inferred("CoM height", f"{height:g} m", text, "likely"),
            Inferred("longest step in reach", f"{longest:.3g} m", f"both feet on the ground, CoM at {height:g} m"),
        ],
    )


def stride(longest: float, leg: float) -> float | None:
    """A stride that is shorter than the usual one, where the legs reach no further [m]; None for the usual one."""
    return None if longest >= _SPARE * _STRIDE * leg else float(np.round(longest / _SPARE, 3))


def _lighter(biped: Biped, leg: float, width: float, low: float, high: float) -> float:
    """The lowest height if hips and knees can do a usual step there, else one at which they carry that, or less.

    That is the lowest of some at which they have torque to spare in a usual step, or a half one, or one in place.
    """
    if _load(biped, leg, width, low, _STRIDE * leg) <= 1.0:
        return low
    heights = np.linspace(low, max(low, high), _HEIGHTS).tolist()
    for part in (1.0, 0.5, 0.0):
        for height in heights:
            if _load(biped, leg, width, height, part * _STRIDE * leg) <= _LOAD:
                return float(height)
    return float(heights[-1])


def _load(biped: Biped, leg: float, width: float, height: float, stride: float) -> float:
    """The largest torque of hip pitch and knee in a step, over its limit; infinite where that is out of reach."""
    size, gait = leg / PACKAGED.leg, GaitConfig()
    duration = gait.ticks_per_step * gait.tick * math.sqrt(size)
    swing = duration * (1.0 - gait.double_support_ticks / gait.ticks_per_step)
    seen = preview(biped, Step(stride, width, height, gait.swing_height * size, duration, swing))
    shares = (seen.torques / biped.effort_limits).reshape(2, -1)
    return math.inf if seen.missed else float(shares[:, [ROLES.index("hip_pitch"), ROLES.index("knee_pitch")]].max())


def _longest_step(biped: Biped, leg: float, width: float, height: float) -> float:
    """The longest step at the heights that a walk there has [m]."""
    amplitude = _AMPLITUDE * leg
    return min(longest_stride(biped, width, height + change) for change in (-amplitude, 0.0, amplitude))


def _end(biped: Biped, width: float, inside: float, step: float) -> float:
    """The end of the band between a height in reach and one that is not, a step further [m]."""
    outside = inside + step
    for _ in range(10):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if reaches(biped, middle, width, 0.0) else (inside, middle)
    return inside
