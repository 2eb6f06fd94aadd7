"""Where on the soles the ZMP box lies, so that a steady walk asks little of the joints."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pdhocbf_drake.robot import SIDES
from pdhocbf_drake.simulation.granted import Asked, largest_torque

_ENOUGH = 0.95  # share of a joint's torque below which the box stays where it is
_ENOUGH_OF_KNEE = 1.22  # likewise of a knee's, where the whole-body program gives way for it
_PARTS, _FARTHEST = 10, 5  # the box moves in steps of that part of the sole's half side, and by so many of them
_GAIN = 0.02  # by which a step has to lessen the largest share


def placed(asked: Asked, stride: float) -> tuple[Asked, str]:
    """The walk with the ZMP box at the place at which the joint with the largest share of its torque has least of it.

    A force that acts farther ahead on the sole passes closer to a bent knee, and one farther outward closer to the
    ankle. The box moves ahead or back, then outward or inward, as long as that helps the steady walk at a stride [m].
    Where a knee is shortest it moves less: a CoM that rides farther ahead of the foot leaves less to a push ahead, and
    in a disturbed walk the plan keeps what the knee holds, see `mpc.limits.zmp_held`.

    Returns:
        The walk, and what is changed in words, empty where nothing is.
    """
    largest, gives_way = largest_torque(asked, stride), asked.scenario.whole_body.kind != "closed_form"
    said, place, found = largest.said, np.zeros(2), asked
    for axis, sign in ((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)):
        for there in () if place[axis] else _places(place, axis, sign):
            if largest.share <= (_ENOUGH_OF_KNEE if gives_way and largest.role == "knee_pitch" else _ENOUGH):
                break
            walk = _at(asked, there)
            less = largest_torque(walk, stride)
            if not less.share < largest.share - _GAIN:
                break
            largest, place, found = less, there, walk
    limits = found.scenario.mpc.plan_limits
    if limits is None or not place.any():
        return asked, ""
    ways = zip(limits.zmp_middle, (("ahead", "behind"), ("outward", "inward")), strict=True)
    where = " and ".join(f"{1e3 * abs(shift):.0f} mm {way[shift < 0.0]}" for shift, way in ways if shift)
    return found, f"the middle of the ZMP box is moved {where} on the soles: {said}"


def _places(place: np.ndarray, axis: int, sign: float) -> Iterator[np.ndarray]:
    """Places farther and farther along an axis, as shares of the soles' half sides."""
    for step in range(1, _FARTHEST + 1):
        there = place.copy()
        there[axis] = sign * step / _PARTS
        yield there


def _at(asked: Asked, place: np.ndarray) -> Asked:
    """The walk with the middle of its box there, where that is on the soles."""
    mpc, limits = asked.scenario.mpc, asked.scenario.mpc.plan_limits
    assert limits is not None
    soles = np.min([asked.biped.soles[side].half_size for side in SIDES], axis=0)
    x, y = np.round(place * soles, 4).tolist()
    length, width = np.round(soles - mpc.zmp_margin, 4).tolist()
    rooms = [("zmp_ahead", x, length), ("zmp_behind", -x, length), ("zmp_outward", y, width), ("zmp_inward", -y, width)]
    ends = {name: min(getattr(limits, name), room) for name, way, room in rooms if way > 0.0}
    moved = limits.model_copy(update={**ends, "zmp_middle": (x, y)})
    return asked.changed(asked.scenario.model_copy(update={"mpc": mpc.model_copy(update={"limits": moved})}))
