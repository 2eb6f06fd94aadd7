"""What a gait is to be good at, as a cost of its measures, and what it must keep for that."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from pdhocbf_drake.simulation.run_log import FINISHED

if TYPE_CHECKING:  # which load Drake
    from pdhocbf_drake.studies.shared.gait_measures import GaitMeasures
    from pdhocbf_drake.studies.tune.joint_limits import JointLimits

_MOST = 0.9  # share of a joint's torque and speed limit
BEYOND: Final = 1e6
"""Added to what a gait uses of a joint's limit where that is more than 0.9: worse than every gait that uses less."""
_SLOWEST = 0.95  # of the commanded speed
_POWER = 8  # of the mean of the joints' shares, near the largest of them


class Aim(NamedTuple):
    """An aim.

    Attributes:
        cost: the smaller the better.
        text: in words, for the help.
    """

    cost: Callable[[GaitMeasures, JointLimits], float]
    text: str


def _torque(gait: GaitMeasures, limits: JointLimits) -> float:
    return float(np.linalg.norm(limits.torque_shares(gait), _POWER))


AIMS: Final[dict[str, Aim]] = {
    "torque": Aim(_torque, "the least torque over the joints' limits"),
    "zmp": Aim(lambda gait, _: -(gait.zmp_inside or 0.0), "the ZMP as far as can be inside its box"),
    "speed": Aim(lambda gait, _: -abs(gait.speed or 0.0), "as fast as joints, reach and ZMP allow"),
    "push": Aim(
        lambda gait, _: -sum(gait.push.values()) if gait.push else -(gait.certified_area or 0.0),
        "the largest pushes survived; while searching, the largest set of states that can walk on for ever",
    ),
}


def cost(
    gait: GaitMeasures, aim: str, joint: str | None, limits: JointLimits, zmp_inside: float, speed: float = 0.0
) -> float:
    """The cost of a gait under an aim; infinite where it doesn't walk, or its ZMP leaves its box.

    A gait that asks too much of a joint costs `BEYOND` and more, the more it asks: a search that begins with one goes
    first to where joints have torque and speed to spare.

    Args:
        gait: as measured.
        aim: of `AIMS`.
        joint: the role whose torque alone counts for the aim "torque"; None for all.
        limits: of the robot's joints.
        zmp_inside: how far inside its box, or outside if negative, the ZMP must stay at least [m].
        speed: that is commanded, and that a gait of which limits grant less does not reach [m/s].
    """
    if gait.ending != FINISHED or gait.zmp_inside is None or gait.zmp_inside < zmp_inside:
        return math.inf
    if aim != "speed" and abs(gait.speed or 0.0) < _SLOWEST * abs(speed):
        return math.inf
    if any(least < 0.0 for least in (gait.h_min or {}).values()):
        return math.inf
    if (share := limits.largest_share(gait)) > _MOST:
        return BEYOND + share
    if aim == "torque" and joint is not None:
        assert gait.torque is not None
        return gait.torque[joint]
    return AIMS[aim].cost(gait, limits)
