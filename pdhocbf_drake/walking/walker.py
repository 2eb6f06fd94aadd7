"""How each step of a commanded walk follows from the one before it and from its command."""

from __future__ import annotations

import math
from typing import NamedTuple

from pdhocbf_drake.walking.commands import STOP, Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.sides import BOTH, LEFT, RIGHT
from pdhocbf_drake.walking.sole_gap import Pose


class Stage(NamedTuple):
    """One step of a commanded walk.

    Attributes:
        number: j.
        side: the stance foot: +1 left, −1 right, 0 both.
        path: the middle between the feet as commanded, and the heading.
        stops: whether the next step is a stand.
    """

    number: int
    side: int
    path: Pose
    stops: bool = False


class Walker:
    """How a step follows from the one before it.

    Args:
        config: of which timing, width, first stance and first stand are read.
    """

    def __init__(self, config: GaitConfig) -> None:
        self._duration = config.ticks_per_step * config.tick
        self._begin, self.width = config.start_steps, config.stance_width
        self._first = LEFT if config.first_stance == "left" else RIGHT

    def after(self, stage: Stage, command: Command, before: Command = STOP) -> Stage:
        """The next step.

        Args:
            stage: this step.
            command: that was taken up at its start.
            before: the last one at which the walk went on, which the first of the two steps of a stop keeps.
        """
        number = stage.number + 1
        if stage.side == BOTH:
            if not command.walks or number < self._begin:
                return stage._replace(number=number)
            return Stage(number, self._first_stance(command), stage.path)
        if stage.stops and not command.walks:
            return Stage(number, BOTH, stage.path)
        side, way = -stage.side, command if command.walks else before
        return Stage(number, side, self._moved(stage.path, way, side), not command.walks)

    def foot(self, stage: Stage) -> Pose:
        """The centre of the stance."""
        return stage.path.moved(0.0, stage.side * self.width / 2.0)

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
