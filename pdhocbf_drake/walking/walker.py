"""How each step of a commanded walk follows from the one before it and from its command."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from pdhocbf_drake.walking.commands import STOP, Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.sides import BOTH, LEFT, RIGHT
from pdhocbf_drake.walking.sole_gap import Pose, sole_gap

GAP = 0.02
"""Least distance between soles as commanded [m]: feet touch the ground a little beyond them, and miss their places."""
WIDEST = 0.06
"""By how much a foot may land farther aside than in a walk that does not turn [m]."""
HALVINGS = 12
_ON_THE_WAY = 0.2, 0.4, 0.6, 0.8


class Stage(NamedTuple):
    """One step of a commanded walk.

    Attributes:
        number: j.
        side: the stance foot: +1 left, −1 right, 0 both.
        path: the middle between the feet as commanded, and the heading.
        aside: distance of the stance foot from that, or of both in a stand [m].
        stops: whether the next step is a stand.
    """

    number: int
    side: int
    path: Pose
    aside: float
    stops: bool = False


def foot(stage: Stage) -> Pose:
    """The centre of the stance."""
    return stage.path.moved(0.0, stage.side * stage.aside)


def swing_gap(start: Pose | None, stance: Pose, end: Pose, sole: tuple[float, float]) -> float:
    """The least gap between a sole that lands, and on its way there if it has a start, and the one that stands [m]."""
    gap = sole_gap(stance, end, sole)
    if start is None:
        return gap
    for share in _ON_THE_WAY:
        there = Pose(*(a + share * (b - a) for a, b in zip(start, end, strict=True)))
        gap = min(gap, sole_gap(stance, there, sole))
    return gap


def apart(start: Pose | None, stance: Pose, stage: Stage, sole: tuple[float, float]) -> Stage:
    """The step with its foot at least as far aside as before, and so far that `swing_gap` is `GAP`, if it can be."""
    if swing_gap(start, stance, foot(stage), sole) >= GAP:
        return stage
    low, high = stage.aside, stage.aside + WIDEST
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        fits = swing_gap(start, stance, foot(stage._replace(aside=middle)), sole) >= GAP
        low, high = (low, middle) if fits else (middle, high)
    return stage._replace(aside=high)


class Walker:
    """How a step follows from the one before it.

    In a walk that turns, a foot lands farther aside where its sole would come too close to the other one.

    Args:
        config: of which timing, width, first stance and first stand are read.
        sole: half length and half width of the soles; None where there are none [m].
        aside: gives the distance of a foot from the path, while a command holds; None for half of the stance width [m].
    """

    def __init__(
        self,
        config: GaitConfig,
        sole: tuple[float, float] | None = None,
        aside: Callable[[Command], float] | None = None,
    ) -> None:
        self._duration = config.ticks_per_step * config.tick
        self._begin, self._half = config.start_steps, config.stance_width / 2.0
        self._sole, self._aside = sole, aside or (lambda command: self._half)
        self._first = LEFT if config.first_stance == "left" else RIGHT

    def after(
        self, stage: Stage, command: Command, before: Command = STOP, last: Stage | None = None, first: int = 0
    ) -> Stage:
        """The next step.

        Args:
            stage: this step.
            command: that was taken up at its start.
            before: the last one at which the walk went on, which the first of the two steps of a stop keeps.
            last: the step before this one, from where a foot then swings.
            first: the foot that stands first after a stand; 0 for the one that the command asks for.
        """
        number = stage.number + 1
        if stage.side == BOTH:
            if not command.walks or number < self._begin:
                return stage._replace(number=number)
            return stage._replace(number=number, side=first or self._first_stance(command))
        if stage.stops and not command.walks:
            return stage._replace(number=number, side=BOTH, stops=False)
        side, way = -stage.side, command if command.walks else before
        path = self._moved(stage.path, way, side)
        following = Stage(number, side, path, self._aside(way), not command.walks)
        start = stage if last is None or last.side != side else last
        if self._sole is None or start.path.yaw == stage.path.yaw == path.yaw:
            return following
        return apart(None if start is stage else foot(start), foot(stage), following, self._sole)

    def standing(self, at: Pose) -> Stage:
        """The stand from which a walk starts, before its step 0."""
        return Stage(-1, BOTH, at, self._half)

    def _first_stance(self, command: Command) -> int:
        """The foot that stands first: a walk to the left begins with the left foot's swing."""
        leads = command.lateral or command.turn
        if not leads:
            return self._first
        return RIGHT if leads > 0.0 else LEFT

    def _moved(self, path: Pose, command: Command, side: int) -> Pose:
        """One step further along the arc of constant velocity and turn rate; sideways only with the leading foot."""
        turn = command.turn * self._duration
        ahead = command.forward * self._duration
        aside = 2.0 * command.lateral * self._duration if side * command.lateral > 0.0 else 0.0
        chord = math.sin(turn / 2.0) / (turn / 2.0) if turn else 1.0
        half = Pose(path.x, path.y, path.yaw + turn / 2.0)
        end = half.moved(chord * ahead, chord * aside)
        return Pose(end.x, end.y, path.yaw + turn)
