"""The reach of the legs: refuses postures, CoM heights, strides and ZMP boxes that a robot can't take."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.robot.biped import Biped
from pdhocbf_drake.robot.ik import WholeBodyIk
from pdhocbf_drake.robot.leg import leg_length
from pdhocbf_drake.robot.posture import Posture, sole_pose

_RESOLUTION = 1.0 / 60.0  # of the limits named in messages, over the length of a leg
_FARTHEST = 10.0 / 3.0  # step that is tried, likewise
_BELOW = 6  # parts of the largest length between which it is looked for impossible ones


def upright_posture(biped: Biped, com: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """q (19,) with an upright torso, from the CoM (3,) and both soles (6,), xyz and roll-pitch-yaw, in the world.

    Raises:
        ModelError: the robot can't reach it.
    """
    result = WholeBodyIk(biped).solve(Posture(com, left, right), biped.bent_knee)
    if not result.ok:
        raise ModelError(
            f"robot {biped.config.name!r} can't stand with CoM {np.round(com, 3).tolist()} and soles at "
            f"{np.round(left[:3], 3).tolist()} and {np.round(right[:3], 3).tolist()} [m]: {result.reason}"
        )
    return result.q


def check_walk(
    biped: Biped,
    *,
    stride: float,
    stance_width: float,
    com_height: float,
    amplitude: float,
    zmp_box: tuple[float, float],
) -> None:
    """Refuses a walk beyond the robot's reach.

    Args:
        biped: the robot.
        stride: step length along x, either sign [m].
        stance_width: lateral distance of the feet [m].
        com_height: commanded CoM height [m].
        amplitude: how far the CoM goes up and down from there [m].
        zmp_box: side lengths of the ZMP box in x and y [m].

    Raises:
        ModelError: CoM height out of reach, stride beyond the legs, soles that overlap, or a ZMP box larger than them.
    """
    check_zmp_box(biped, zmp_box)
    check_apart(biped, stance_width)
    heights = com_height + amplitude, com_height - amplitude
    if not all(reaches(biped, height, stance_width, 0.0) for height in heights):
        raise ModelError(_height_out_of_reach(biped, com_height, amplitude, stance_width))
    if not all(reaches(biped, height, stance_width, stride) for height in heights):
        longest = min(longest_stride(biped, stance_width, height) for height in heights)
        raise ModelError(
            f"gait.stride: a step of {stride:g} m is beyond the legs' reach of robot {biped.config.name!r} "
            f"with {_at(com_height, amplitude)}; allowed is up to {longest:.3g} m"
        )


def check_zmp_box(biped: Biped, zmp_box: tuple[float, float], key: str = "gait.zmp_box") -> None:
    """Refuses a box of eq. (27) that is larger than the smaller sole: with the ZMP outside the sole the foot tips."""
    sole = 2 * np.min([biped.soles[side].half_size for side in ("left", "right")], axis=0)
    if (np.array(zmp_box) > sole + 1e-9).any():
        raise ModelError(
            f"{key}: a ZMP box of {zmp_box[0]:g} x {zmp_box[1]:g} m is larger than the sole of robot "
            f"{biped.config.name!r}; "
            f"allowed is up to {sole[0]:g} x {sole[1]:g} m"
        )


def check_apart(biped: Biped, stance_width: float) -> None:
    """Refuses feet so close together that their soles overlap."""
    least = sum(float(biped.soles[side].half_size[1]) for side in ("left", "right"))
    if stance_width < least:
        raise ModelError(
            f"{_key(biped, 'stance_width', stance_width)}: the soles of robot {biped.config.name!r} overlap with its "
            f"feet {stance_width:g} m apart; allowed is {least:.4g} m or more"
        )


def _height_out_of_reach(biped: Biped, com_height: float, amplitude: float, stance_width: float) -> str:
    """What is wrong with a height at which the robot can't stand upright on both feet at that width, or with that."""
    good = reachable_heights(biped, stance_width)
    least, most = (good[0] + amplitude, good[-1] - amplitude) if len(good) else (1.0, 0.0)
    key, allowed = _key(biped, "com_height", com_height), f"allowed is {least:.3g} to {most:.3g} m"
    if not len(good):
        key = _key(biped, "stance_width", stance_width)
        allowed = "no height is in reach with these so far apart"
    elif least > most:
        key, allowed = "gait.com_height_amplitude", f"allowed is up to {(good[-1] - good[0]) / 2.0:.3g} m"
    return (
        f"{key}: {_at(com_height, amplitude)} is out of reach of robot {biped.config.name!r} "
        f"with its feet {stance_width:g} m apart; {allowed}"
    )


def _at(com_height: float, amplitude: float) -> str:
    """The CoM height as it is given, and what the amplitude makes of it."""
    around = (
        f" ({com_height - amplitude:.3g} to {com_height + amplitude:.3g} m with its amplitude)" if amplitude else ""
    )
    return f"the CoM at {com_height:g} m{around}"


def _key(biped: Biped, name: str, value: float) -> str:
    """The key of a gait's value, with that of the robot's file where the value is that one."""
    own = f", by default {name} of the robot's file" if value == getattr(biped.config, name) else ""
    return f"gait.{name}{own}"


def reachable_heights(biped: Biped, stance_width: float) -> np.ndarray:
    """The CoM heights at which the robot can stand upright on both feet, of those a sixtieth of a leg apart [m]."""
    leg = leg_length(biped)
    heights = np.arange(0.0, 2.0 * leg, leg * _RESOLUTION)
    return np.array([height for height in heights if reaches(biped, height, stance_width, 0.0)])


def longest_stride(biped: Biped, stance_width: float, height: float) -> float:
    """The longest step at a CoM height, with both feet on the ground and the CoM above their middle [m]."""
    return _largest(lambda length: reaches(biped, height, stance_width, length), leg_length(biped))


def widest_step(biped: Biped, height: float) -> float:
    """The largest lateral distance of the feet at a CoM height, with the CoM above their middle [m]."""
    return _largest(lambda width: reaches(biped, height, width, 0.0), leg_length(biped))


def reaches(biped: Biped, height: float, width: float, stride: float) -> bool:
    """Whether it can stand upright on both feet, a stride and a width apart [m], with its CoM above their middle."""
    left, right = sole_pose(stride / 2, width / 2), sole_pose(-stride / 2, -width / 2)
    return WholeBodyIk(biped).solve(Posture(np.array([0.0, 0.0, height]), left, right), biped.bent_knee).ok


def _largest(possible: Callable[[float], bool], leg: float) -> float:
    """The largest length up to which all are possible, by bisection [m].

    Stops of the ankles may forbid lengths below possible ones, so that some of these are tried too.
    """
    low, high = 0.0, leg * _FARTHEST
    while True:
        while high - low > leg * _RESOLUTION:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if possible(middle) else (low, middle)
        tried = [low * part / _BELOW for part in range(_BELOW)]
        gap = next((i for i in range(1, _BELOW) if low and not possible(tried[i])), None)
        if gap is None:
            return low
        low, high = tried[gap - 1], tried[gap]
