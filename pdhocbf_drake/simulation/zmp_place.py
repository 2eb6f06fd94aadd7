"""Where on the soles the ZMP may lie, so that a steady walk asks little of the joints."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pdhocbf_drake.mpc.config import PlanLimits
from pdhocbf_drake.robot import SIDES
from pdhocbf_drake.simulation.granted import Asked, Largest, largest_torque

_ENOUGH = 0.95  # share of a joint's torque below which the box stays where it is
_ENOUGH_OF_KNEE = 1.22  # likewise of a knee's, where the whole-body program gives way for it
_PARTS, _FARTHEST = 10, 5  # the box moves in steps of that part of the sole's half side, and by so many of them
_GAIN = 0.02  # by which a step has to lessen the largest share
_ROOMS = {
    "ankle_pitch": (0, {"zmp_ahead": "ahead", "zmp_behind": "behind"}),
    "ankle_roll": (1, {"zmp_outward": "outward", "zmp_inward": "inward"}),
}


def placed(asked: Asked, stride: float) -> tuple[Asked, str]:
    """The walk with the ZMP where the joint with the largest share of its torque has least of it.

    A force that acts farther ahead on the sole passes closer to a bent knee, and one farther outward closer to the
    ankle. The box moves ahead or back, then outward or inward, as long as that helps the steady walk at a stride [m].
    Where a knee is shortest it moves less: a CoM that rides farther ahead of the foot leaves less to a push ahead, and
    in a disturbed walk the plan keeps what the knee holds, see `mpc.limits.zmp_held`. Where an ankle still lacks
    torque, the box is cut on one side: a force that leans inwards passes an ankle's axis farther inwards than its ZMP,
    by more than the share of the torque that `fitting.plan_limits` leaves for it.

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
    limits, words = found.scenario.mpc.plan_limits, list[str]()
    if limits is not None and place.any():
        names = zip(limits.zmp_middle, (("ahead", "behind"), ("outward", "inward")), strict=True)
        where = " and ".join(f"{1e3 * abs(shift):.0f} mm {name[shift < 0.0]}" for shift, name in names if shift)
        words.append(f"the middle of the ZMP box is moved {where} on the soles")
    if largest.share > 1.0:
        found, cut = _cut(found, largest, stride)
        words += [cut] if cut else []
    return found, f"{' and '.join(words)}: {said}" if words else ""


def _cut(asked: Asked, largest: Largest, stride: float) -> tuple[Asked, str]:
    """The walk with its box cut on the side where that helps the ankle that lacks torque, and that in words."""
    axis, ways = _ROOMS.get(largest.role, (0, {}))
    for room, way in ways.items():
        share, best, said = largest.share, asked, ""
        for part in range(1, _FARTHEST + 1):
            walk, cut = _without(asked, axis, room, part)
            less = largest_torque(walk, stride).share
            if not less < share - _GAIN:
                break
            share, best, said = less, walk, f"the ZMP stays off the last {1e3 * cut:.0f} mm of its box {way}"
            if share <= _ENOUGH:
                break
        if said:
            return best, said
    return asked, ""


def _without(asked: Asked, axis: int, room: str, part: int) -> tuple[Asked, float]:
    """The walk without so many parts of half its box on one side, and what is cut of it [m]."""
    mpc, limits = asked.scenario.mpc, asked.scenario.mpc.plan_limits
    assert limits is not None
    half, middle = asked.scenario.gait.zmp_box[axis] / 2.0 - mpc.zmp_margin, limits.zmp_middle[axis]
    edges = {
        name: min(getattr(limits, name), half + sign * middle)
        for name, sign in zip(_ROOMS["ankle_roll" if axis else "ankle_pitch"][1], (1.0, -1.0), strict=True)
    }
    cut = part * 0.5 * sum(edges.values()) / _PARTS
    return _with(asked, limits.model_copy(update={room: round(edges[room] - cut, 4)})), cut


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
    return _with(asked, limits.model_copy(update={**ends, "zmp_middle": (x, y)}))


def _with(asked: Asked, limits: PlanLimits) -> Asked:
    mpc = asked.scenario.mpc.model_copy(update={"limits": limits})
    return asked.changed(asked.scenario.model_copy(update={"mpc": mpc}))
