"""How far a walk has come whose commands become known while it walks, and how its next steps follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from pdhocbf_drake.walking.commands import Command
from pdhocbf_drake.walking.sole_gap import Pose
from pdhocbf_drake.walking.walker import Stage, Walker


class Course(NamedTuple):
    """What decides the coming steps, as long as the command of this step holds.

    Attributes:
        before, this: the last step and this one, j.
        command: as it is granted to step j.
        asked: the same before its limits.
        moving: the last command before it at which the walk went on.
        settled: whether the command of step j is that of the step before.
    """

    before: Stage
    this: Stage
    command: Command
    asked: Command
    moving: Command
    settled: bool

    def after(self, walker: Walker, asked: Command, granted: Callable[[Command], Command]) -> Course:
        """The course of step j + 1, at which the command `asked` is taken up."""
        moving, command = self.command if self.command.walks else self.moving, granted(asked)
        this = walker.after(self.this, self.command, self.moving, self.before)
        return Course(self.this, this, command, asked, moving, command == self.command)

    def stage(self, walker: Walker, step: int) -> Stage:
        """Any step from j − 1 on, of which those after j + 1 are an expectation."""
        if step < self.this.number:
            return self.before._replace(number=step)
        before, stage = self.before, self.this
        while stage.number < step:
            before, stage = stage, walker.after(stage, self.command, self.moving, before)
        return stage

    @property
    def numbers(self) -> list[float]:
        """The same as numbers, `SIZE` of them: j, then the rest in its order."""
        stages = [number for s in (self.before, self.this) for number in (s.side, *s.path, s.aside, s.stops)]
        return [*map(float, (self.this.number, *stages, *self.command, *self.asked, *self.moving, self.settled))]

    @classmethod
    def of(cls, numbers: Sequence[float]) -> Course | None:
        """The inverse of `numbers`; None for those of a walk that has no course, of which the first is −1."""
        step = round(numbers[0])
        if step < 0:
            return None
        before, this = (
            Stage(step - 1 + i, round(side), Pose(x, y, yaw), aside, bool(stops))
            for i, (side, x, y, yaw, aside, stops) in enumerate((numbers[1:7], numbers[7:13]))
        )
        commands = [
            Command(forward, lateral, turn, bool(walks))
            for forward, lateral, turn, walks in (numbers[13:17], numbers[17:21], numbers[21:25])
        ]
        return cls(before, this, commands[0], commands[1], commands[2], bool(numbers[25]))


SIZE = 26
"""Length of `Course.numbers`."""
NO_COURSE = (-1.0, *[0.0] * (SIZE - 1))
"""The numbers of a walk all of whose commands its scenario has."""
