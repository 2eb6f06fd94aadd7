"""Footsteps of a walk that follows commands: each from the one before it and from the command of its step."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.kept import Kept
from pdhocbf_drake.walking.command_limits import Limits
from pdhocbf_drake.walking.commands import STOP, Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.course import UNSETTLED, Course
from pdhocbf_drake.walking.footsteps import Footstep, Footsteps
from pdhocbf_drake.walking.sides import BOTH
from pdhocbf_drake.walking.sole_gap import Pose
from pdhocbf_drake.walking.walker import Stage, Walker, foot

_COURSES = 4  # whose steps are kept


class Line:
    """The steps of a walk under its commands, made when they are first asked for."""

    def __init__(self, config: GaitConfig, commands: Callable[[float], Command], start: Pose, limits: Limits) -> None:
        self.config, self.limits, self._commands = config, limits, commands
        aside = lru_cache(maxsize=256)(lambda command: limits.aside(command, config))
        self.walker = Walker(config, limits.sole, aside)
        self.ticks = config.ticks_per_step
        self.granted = lru_cache(maxsize=256)(lambda command: limits.granted(command, config))
        self._stages = [self.walker.standing(start)]
        self._ahead: dict[int, list[Stage]] = {}  # what is expected from one step's command on
        self._of_courses = Kept[tuple[list[Stage], Iterator[Stage]]](_COURSES)
        self._moving = [STOP]  # the last command at which the walk went on, at each of these steps

    def asked(self, step: int) -> Command:
        """The command that is taken up at the start of step j, before its limits."""
        return self._commands(max(step, 0) * self.ticks * self.config.tick)

    def command(self, step: int) -> Command:
        """The same, as it is granted."""
        return self.granted(self.asked(step))

    def course(self, step: int) -> Course:
        """How far the walk has come at step j under the commands so far."""
        before, this, command = self.stage(step - 1, None), self.stage(step, None), self.command(step)
        recent = tuple(map(self.under, range(step - 1, step - 1 - UNSETTLED, -1)))
        settled = command == self.command(step - 1)
        return Course(before, this, command, self.asked(step), self._moving[step + 1], settled, recent)

    def under(self, step: int) -> Command:
        """What step j walks under: its command, or in a stand a stop."""
        return STOP if self.stage(step, None).side == BOTH else self.command(step)

    def after(self, course: Course, asked: Command | None, first: int) -> Course:
        """The next step's course, at which the command `asked` is taken up; None for the one that `asked` has."""
        command = self.asked(course.this.number + 1) if asked is None else asked
        return course.after(self.walker, command, self.granted, first)

    def stage_of(self, course: Course, step: int) -> Stage:
        """Step j of a walk that has come so far under other commands, from the one before its present one on."""
        if step < course.this.number:
            return course.before._replace(number=step)
        stages, coming = self._of_courses.get(course, lambda: ([], course.stages(self.walker)))
        while len(stages) <= step - course.this.number:
            stages.append(next(coming))
        return stages[step - course.this.number]

    def stage(self, step: int, known: int | None) -> Stage:
        """Step j; with `known`, as it is expected from the commands up to that step."""
        if step < -1:
            return self._stages[0]._replace(number=step)
        if known is not None and step > known + 1:
            return self._expected(step, known)
        while len(self._stages) < step + 2:
            last = self._stages[-1]
            command, moving = self.command(last.number), self._moving[-1]
            self._stages.append(self.walker.after(last, command, moving, self._before(last)))
            self._moving.append(command if command.walks else moving)
        return self._stages[step + 1]

    def _expected(self, step: int, known: int) -> Stage:
        if known not in self._ahead:
            self._ahead.clear()
            self._ahead[known] = [self.stage(known, None), self.stage(known + 1, None)]
        ahead, command = self._ahead[known], self.command(known)
        while len(ahead) < step - known + 1:
            ahead.append(self.walker.after(ahead[-1], command, self._moving[known + 1], ahead[-2]))
        return ahead[step - known]

    def _before(self, stage: Stage) -> Stage | None:
        return self._stages[stage.number] if stage.number >= 0 else None


@dataclass(frozen=True)
class CommandedFootsteps(Footsteps):
    """Footsteps that follow commands. What a step commands of those after the next one is an expectation, see `seen`.

    Attributes:
        line: the steps under the commands.
        known: the step whose command is expected to hold from then on; None where all commands are known.
        course: where commands become known while it walks: how far it has come. Then steps from the one before the
            course's on can be asked for.
        keeps_path: whether a walk that is pushed off its path returns to it, rather than going on from where it is.
    """

    line: Line | None = None
    known: int | None = None
    course: Course | None = None
    keeps_path: bool = False

    @classmethod
    def of(
        cls, config: GaitConfig, commands: Callable[[float], Command], start: Pose, limits: Limits,
        keeps_path: bool = False,
    ) -> CommandedFootsteps:  # fmt: skip
        """The footsteps under the command that holds at each time [s], from a stand at `start`."""
        line = Line(config, commands, start, limits)
        return cls((), (0.0, 0.0), config.stance_width, line=line, keeps_path=keeps_path)

    @property
    def end(self) -> int | None:
        """The last single-support step before the stand that is expected next; None where none is."""
        if self.last is not None:
            return super().end
        if self.known is None:
            return None
        for step in range(self.known, self.known + 3):
            if self._before_the_end(step).side == BOTH:
                return max(step - 1, self.resumed.last)
        return None

    @property
    def turns(self) -> bool:
        """True: any heading may be commanded."""
        return True

    def seen(self, step: int) -> CommandedFootsteps:
        """The same, as they are expected at step j: its command holds on."""
        return replace(self, known=step)

    def granted(self, asked: Command) -> Command:
        """See `Footsteps.granted`."""
        assert self.line is not None
        return self.line.granted(asked)

    def following(self, course: Course | None) -> CommandedFootsteps:
        """The same for a walk that has come that far under other commands."""
        return replace(self, course=course)

    def course_after(self, step: int, asked: Command | None, held: bool = False) -> Course | None:
        """The course of step j + 1, at which the command `asked` is taken up; None for the scenario's own.

        Where that step takes the place of a stand, a walk that begins after it begins with the other foot.
        A walk that is to stand after its `last` step keeps the course of that, if it has one. With `held` it turns no
        more, unless it keeps its path.
        """
        assert self.line is not None
        if self.last is not None and step >= self.last:
            return self.course
        course = self.course or self.line.course(step)
        in_place = self._commanded(step + 1).side == BOTH
        following = self.line.after(course, asked, -self[step + 1].side if in_place else 0)
        return following._replace(held=held and not self.keeps_path)

    def holding(self, step: int) -> Course | None:
        """See `Footsteps.holding`."""
        if self.line is None or self.keeps_path:
            return None
        course = self.course or self.line.course(step)
        turns = course.command.turn or course.moving.turn
        return course._replace(held=True) if turns and not course.held and course.this.number == step else None

    def replanned(self, step: int, stance: tuple[float, float], yaw: float) -> Course | None:
        """See `Footsteps.replanned`; a walk along waypoints, and one that has ended, keep their paths."""
        if self.line is None or self.keeps_path:
            return None
        course = self.course or self.line.course(step)
        if course.this.number != step:
            return None
        here = Pose(*stance, course.this.path.yaw if math.isnan(yaw) else yaw)
        return course.from_path(here.moved(0.0, -self[step].side * self.aside(step)))

    def path(self, step: int) -> tuple[float, ...]:
        """See `Gait.path`."""
        this = self[step]
        middle = Pose(this.x, this.y, this.yaw).moved(0.0, -this.side * self.aside(step))
        return *middle, *self._taken_up(step)[0]

    def aside(self, step: int) -> float:
        """See `Footsteps.aside`."""
        return self._stage(step if self.last is None else min(step, self.last)).aside

    @property
    def sole(self) -> tuple[float, float] | None:
        """See `Footsteps.sole`."""
        return None if self.line is None else self.line.limits.sole

    def asked(self, step: int) -> Command:
        """See `Gait.asked`."""
        return self._taken_up(step)[1]

    def settled(self, step: int) -> bool:
        """Whether the command of step j is that of the step before."""
        if self.course is not None:
            return self.course.settled
        return self.line is None or self.line.command(step) == self.line.command(step - 1)

    def under(self, step: int) -> set[Command]:
        """The commands between whose orbits step j walks: its own, and those of the `UNSETTLED` steps before it.

        A stand, the last two steps before one, and the step of it before a walk begins have a stop among theirs; steps
        in place of a stand have stepping in place.
        """
        assert self.line is not None
        known = step if self.known is None else min(step, self.known)
        before = [self.under_now(j) for j in range(step - UNSETTLED, step)]
        command = self.line.command(known) if self.course is None else self.course.command
        ended = self.last is not None and step >= self.last - 1
        return {*before, self.under_now(step), STOP if ended else command}

    def under_now(self, step: int) -> Command:
        """What step j walks under: its command, or in a stand a stop."""
        assert self.line is not None
        if self.course is not None and step < self.course.this.number:
            command = self.course.recent[min(self.course.this.number - 1 - step, UNSETTLED - 1)]
        elif self._commanded(step).side == BOTH:
            command = STOP
        elif self.course is not None:
            command = self.course.command
        else:
            command = self.line.command(step if self.known is None else min(step, self.known))
        if self.last is not None and step >= self.last - 1:
            command = STOP
        in_place = self.resumed.tick // self.line.ticks <= step <= self.resumed.last
        return Command() if in_place and not command.walks else command

    def with_stride(self, stride: float, step: int) -> Footsteps:
        """Raises `InputError`: the stride follows from the commands."""
        raise InputError("commands: a walk that follows commands has no stride to change")

    def _taken_up(self, step: int) -> tuple[Command, Command]:
        """The command of step j as it is granted, and before its limits; in a stand a stop."""
        if self.line is None or self[step].side == BOTH:
            return STOP, STOP
        if self.course is not None:
            return self.course.command, self.course.asked
        return self.line.command(step), self.line.asked(step)

    def _before_the_end(self, step: int) -> Footstep:
        assert self.line is not None
        stage, ticks = self._stage(step), self.line.ticks
        return Footstep(stage.side, *foot(stage), 0.0, step * ticks, ticks)

    def _stage(self, step: int) -> Stage:
        assert self.line is not None
        if self.course is None:
            return self.line.stage(step, self.known)
        return self.line.stage_of(self.course, step)
