"""The CoM height at which a robot can walk, and the longest step there, from a scan of its reach."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.importing.inferred import Inferred
from pdhocbf_drake.robot import Biped, longest_stride
from pdhocbf_drake.robot.reach import reachable_heights, reaches

_BEND = 0.091  # by which the CoM is below its highest place, as a share of the leg: knees bent by 54°, as ours
_AMPLITUDE = 1.0 / 60.0  # of the CoM's height in a walk, as a share of the leg
_STRIDE = 0.25  # of a walk, as a share of the leg
_SPARE = 1.1


def com_height(biped: Biped, leg: float, width: float) -> tuple[float, Inferred]:
    """The CoM height [m] with the knees well bent, within the band in reach.

    Args:
        biped: the robot. leg: length of thigh and shank [m]. width: lateral distance of the feet [m].

    Raises:
        ModelError: the robot can't stand at any height.
    """
    grid = leg / 60.0
    band = reachable_heights(biped, width, grid)
    if len(band) == 0:
        raise ModelError("the robot can't stand on both feet at any height; is a joint's role or limit wrong?")
    low, high = (_end(biped, width, float(inside), step) for inside, step in ((band[0], -grid), (band[-1], grid)))
    amplitude = _AMPLITUDE * leg
    height = high - _BEND * leg
    if height < low + amplitude:
        height = max((low + high) / 2.0, min(low + amplitude, high))
    height = float(np.round(height, 3))
    text = f"in reach with level feet are {low:.3g} to {high:.3g} m"
    return height, Inferred("CoM height", f"{height:g} m", text, "likely")


def stride(biped: Biped, leg: float, width: float, height: float) -> tuple[float | None, Inferred]:
    """A stride that is shorter than the usual one, where the legs reach no further [m]; None for the usual one."""
    heights = (height - _AMPLITUDE * leg, height, height + _AMPLITUDE * leg)
    longest = min(longest_stride(biped, width, other) for other in heights)
    fact = Inferred("longest step in reach", f"{longest:.3g} m", f"both feet on the ground, CoM at {height:g} m")
    usual = _STRIDE * leg
    return (None if longest >= _SPARE * usual else round(longest / _SPARE, 3)), fact


def _end(biped: Biped, width: float, inside: float, step: float) -> float:
    """The end of the band between a height in reach and one that is not, a step further [m]."""
    outside = inside + step
    for _ in range(10):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if reaches(biped, middle, width, 0.0) else (inside, middle)
    return inside
