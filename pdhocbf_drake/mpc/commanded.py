"""The steps that a gait commands over the horizon."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.config import PlanLimits
from pdhocbf_drake.walking import Footstep, Gait
from pdhocbf_drake.walking.frame import inner_share, rotation
from pdhocbf_drake.walking.sides import BOTH

_ACROSS = 0.1  # cosine between the axis ahead and x, below which windows along x are no limit ahead


class Commanded(NamedTuple):
    """Steps j … j + n_f as commanded, seen in the axes of the stance foot; every array has the axes x, y first.

    Attributes:
        steps: the gait's own, of j … j + n_f.
        moves: from one step's centre to the next one's, j + 1 … j + n_f, shape (2, n_f) [m].
        half: half sides of the box in steps j − 1 … j + n_f, less the margin, shape (2, n_f + 2) [m]. Of a foot with
            another heading it is the largest similar rectangle inside its box.
        shift: of the box's middle from the centre of the stance, where an ankle's torque cuts a side off, shape
            (2, n_f + 2) [m]; None where nothing is cut off.
        centre: commanded centre of step j, from the world's origin [m].
        repeats: whether step j and step j + n_f both lie in the walk proper, so that a gait repeats.
        yaw: heading of the stance foot, along which the axes are [rad].
        turn: heading of step j + n_f less that of step j [rad].
        sole: as `Footsteps.sole`.
        flipped: as `Gait.flipped`.
        windows: from and to where the foot of each coming step may land along the axis ahead, from the world's origin,
            shape (n_f, 2) [m]; None on level ground.
        early: how long before its touchdown the swing foot of step j is where it lands [ticks].
    """

    steps: tuple[Footstep, ...]
    moves: np.ndarray
    half: np.ndarray
    shift: np.ndarray | None
    centre: tuple[float, float]
    repeats: bool
    yaw: float = 0.0
    turn: float = 0.0
    sole: tuple[float, float] | None = None
    flipped: bool = False
    windows: np.ndarray | None = None
    early: int = 0

    @property
    def ways(self) -> np.ndarray:
        """`moves` in the world's axes [m]."""
        return rotation(self.yaw) @ self.moves if self.yaw else self.moves


class CommandedSteps:
    """Reads the gait ahead of a step, and keeps the last few answers.

    Args:
        margin: how far inside the box of the gait the ZMP is planned to stay [m].
        limits: what the robot's joints leave to the plan.
    """

    def __init__(self, gait: Gait, horizon: int, margin: float, limits: PlanLimits | None = None) -> None:
        self._gait, self._count = gait, horizon // gait.period
        self._box = cache(lambda side: _box(gait, side, margin, limits))
        self.steps = lru_cache(maxsize=4)(self._steps)

    def _steps(self, step: int) -> Commanded:
        seen = self._gait.seen(step)
        before, *ahead = (self._gait.step(step - 1), *(seen[step + i] for i in range(self._count + 1)))
        centres = np.array([[s.x, s.y] for s in ahead]).T
        boxes = [self._box(s.side) for s in (before, *ahead)]
        half, shift = np.array([box.half for box in boxes]).T, None
        yaw, turn = ahead[0].yaw, ahead[-1].yaw - ahead[0].yaw
        if yaw:
            centres = rotation(-yaw) @ centres
        if any(box.is_cut for box in boxes):
            middles = zip((before, *ahead), boxes, strict=True)
            shift = np.column_stack([rotation(s.yaw - yaw) @ box.middle for s, box in middles])
        for i, s in enumerate((before, *ahead)):
            if s.yaw != yaw:
                half[:, i] *= inner_share(-half[:, i], half[:, i], yaw - s.yaw)
        x, y = centres[:, 0].tolist()
        repeats = BOTH not in (ahead[0].side, ahead[-1].side) and seen.settled(step)
        flipped, moves = self._gait.flipped(step), centres[:, 1:] - centres[:, :-1]
        windows, early = None, 0
        if self._gait.uneven:
            windows, early = _windows(ahead[1:], centres[0, 1:], yaw), self._gait.profiles(step)[0].early
        return Commanded(
            tuple(ahead), moves, half, shift, (x, y), repeats, yaw, turn, seen.sole, flipped, windows, early
        )


class _Box(NamedTuple):
    """The ZMP box of a step as limits leave it, in the axes of its foot.

    Attributes:
        half: half sides (2,) [m].
        middle: from the centre of the stance to the box's (2,) [m].
        is_cut: whether limits cut a side off.
    """

    half: list[float]
    middle: np.ndarray
    is_cut: bool


def _box(gait: Gait, side: int, margin: float, limits: PlanLimits | None) -> _Box:
    """That of a step on this foot."""
    own = gait.region.half(side)
    half = own - margin
    low, high = -half, half.copy()
    if limits is not None:
        apart = own[1] - gait.region.half_of_foot[1]  # 0 but in a stand
        inward = limits.zmp_outward if side == BOTH else limits.zmp_inward
        aside = np.array([inward, limits.zmp_outward])[:: -1 if side < 0 else 1] + apart
        for edge in (low, high):
            edge += np.array(limits.zmp_middle) * [side != BOTH, side]
        low = np.maximum(low, [-limits.zmp_behind, -aside[0]])
        high = np.minimum(high, [limits.zmp_ahead, aside[1]])
        high = np.maximum(high, low)  # `fitting.plan_limits` refuses what leaves nothing
    is_cut = not ((low == -half).all() and (high == half).all())
    return _Box((0.5 * (high - low)).tolist(), 0.5 * (low + high), is_cut)


def _windows(steps: Sequence[Footstep], places: np.ndarray, yaw: float) -> np.ndarray:
    """`Commanded.windows` of steps at these places along the axis ahead, which has a heading [m, rad].

    Windows are along the world's x. What a foot may move ahead is what it may move along x, over the cosine between
    them, as long as it keeps its place aside.
    """
    along = math.cos(yaw)
    if abs(along) < _ACROSS:  # along edges, which no move ahead comes to
        return np.full((len(steps), 2), [-np.inf, np.inf])
    room = np.array([[limit - step.x for limit in step.window] for step in steps]) / along
    return places[:, None] + np.sort(room, axis=1)
