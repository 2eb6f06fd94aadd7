"""How far a walk has come whose commands become known while it walks, and how its next steps follow."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from pdhocbf_drake.walking.commands import STOP, Command
from pdhocbf_drake.walking.frame import turned
from pdhocbf_drake.walking.sides import BOTH
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
        recent: what the last steps walked under, the latest first, as `CommandedFootsteps.under`.
        first: where step j is one in place of a stand: the foot that stands next; 0 elsewhere.
        held: whether it keeps its heading, whatever is commanded.
    """

    before: Stage
    this: Stage
    command: Command
    asked: Command
    moving: Command
    settled: bool
    recent: tuple[Command, ...]
    first: int = 0
    held: bool = False

    def after(self, walker: Walker, asked: Command, granted: Callable[[Command], Command], first: int) -> Course:
        """The course of step j + 1, at which the command `asked` is taken up."""
        moving, command = self.command if self.command.walks else self.moving, granted(asked)
        stages = self.stages(walker)
        _, this = next(stages), next(stages)
        under = STOP if self.this.side == BOTH else self.command
        recent = under, *self.recent[:-1]
        return Course(self.this, this, command, asked, moving, command == self.command, recent, first)

    def from_path(self, path: Pose) -> Course:
        """The same where the path of step j is that one: all that was and is to come moves with it."""
        old = self.this.path
        turn = math.remainder(path.yaw - old.yaw, math.tau)
        x, y = turned((self.before.path.x - old.x, self.before.path.y - old.y), turn)
        before = Pose(path.x + x, path.y + y, self.before.path.yaw + turn)
        this = self.this._replace(path=Pose(path.x, path.y, old.yaw + turn))
        return self._replace(this=this, before=self.before._replace(path=before))

    def stages(self, walker: Walker) -> Iterator[Stage]:
        """Step j, j + 1, …, of which those after j + 1 are an expectation."""
        before, stage, command, moving = self.before, self.this, self.command, self.moving
        if self.held:
            command, moving = command._replace(turn=0.0), moving._replace(turn=0.0)
        first = self.first
        while True:
            yield stage
            before, stage, first = stage, walker.after(stage, command, moving, before, first), 0

    @property
    def numbers(self) -> list[float]:
        """The same as numbers, `SIZE` of them: j, then the rest in its order."""
        stages = [number for s in (self.before, self.this) for number in (s.side, *s.path, s.aside, s.stops)]
        commands = [number for command in (self.command, self.asked, self.moving, *self.recent) for number in command]
        return [*map(float, (self.this.number, self.settled, self.first, self.held, *stages, *commands))]

    @classmethod
    def of(cls, numbers: Sequence[float]) -> Course | None:
        """The inverse of `numbers`; None for those of a walk that has no course, of which the first is −1."""
        step = round(numbers[0])
        if step < 0:
            return None
        before, this = (
            Stage(step - 1 + i, round(side), Pose(x, y, yaw), aside, bool(stops))
            for i, (side, x, y, yaw, aside, stops) in enumerate((numbers[4:10], numbers[10:16]))
        )
        command, asked, moving, *recent = (
            Command(numbers[i], numbers[i + 1], numbers[i + 2], bool(numbers[i + 3])) for i in range(16, SIZE, 4)
        )
        settled, first, held = bool(numbers[1]), round(numbers[2]), bool(numbers[3])
        return cls(before, this, command, asked, moving, settled, tuple(recent), first, held)


UNSETTLED = 5
"""Steps from a new command on until the walk follows its orbit."""
SIZE = 4 + 2 * 6 + (3 + UNSETTLED) * 4
"""Length of `Course.numbers`."""
NO_COURSE = (-1.0, *[0.0] * (SIZE - 1))
"""The numbers of a walk all of whose commands its scenario has."""
