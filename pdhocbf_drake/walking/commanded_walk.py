"""Footsteps of a walk that follows commands: each from the one before it and from the command of its step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking.commands import STOP, Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.footsteps import BOTH, LEFT, RIGHT, Footstep, Footsteps
from pdhocbf_drake.walking.sole_gap import Pose, sole_gap

_LEAST_GAP = 0.012  # between soles as commanded [m]; walks come 2 mm closer
_LARGEST_TURN = 0.4  # of one step [rad]
_HALVINGS = 12
_SAMPLES = 5  # of a swing, at which the passing sole is checked
_AHEAD = 4


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


@dataclass(frozen=True)
class Limits:
    """What legs, soles and programs allow; a command beyond it is granted in part.

    Attributes:
        stride: longest way of the path in a step, along the heading or across it [m].
        sole: half length and half width of the soles; None where there are none [m].
    """

    stride: float = 0.23
    sole: tuple[float, float] | None = None

    def granted(self, command: Command, config: GaitConfig) -> Command:
        """The command, its velocity and then its turn rate reduced to what is possible."""
        if not command.walks:
            return STOP
        duration = config.ticks_per_step * config.tick
        # Sideways the leading foot makes the way of two steps.
        share = math.hypot(command.forward, 2.0 * command.lateral) * duration / self.stride
        fewer = command if share <= 1.0 else command._replace(
            forward=command.forward / share, lateral=command.lateral / share
        )  # fmt: skip
        most = _LARGEST_TURN / duration
        turn = min(max(command.turn, -most), most)
        if self._least_gap(fewer._replace(turn=turn), config) < _LEAST_GAP:
            low, high = 0.0, 1.0
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                fits = self._least_gap(fewer._replace(turn=middle * turn), config) >= _LEAST_GAP
                low, high = (middle, high) if fits else (low, middle)
            turn *= low
        return fewer._replace(turn=turn)

    def _least_gap(self, command: Command, config: GaitConfig) -> float:
        """The least gap between the soles in a walk at this command, also where one passes the other [m]."""
        if self.sole is None or not command.turn:
            return math.inf
        walk, stage, feet = Walker(config), Stage(0, LEFT, Pose(0.0, 0.0, 0.0)), []
        for _ in range(_AHEAD):
            feet.append(walk.foot(stage))
            stage = walk.after(stage, command)
        gaps = [sole_gap(one, other, self.sole) for one, other in pairwise(feet)]
        for start, stance, end in zip(feet, feet[1:], feet[2:], strict=False):
            for i in range(1, _SAMPLES):
                s = i / _SAMPLES
                swing = Pose(*(a + s * (b - a) for a, b in zip(start, end, strict=True)))
                gaps.append(sole_gap(swing, stance, self.sole))
        return min(gaps)


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


class Line:
    """The steps of a walk under its commands, made when they are first asked for."""

    def __init__(self, config: GaitConfig, commands: Callable[[float], Command], start: Pose, limits: Limits) -> None:
        self.config, self.walker, self._commands = config, Walker(config), commands
        self.ticks = config.ticks_per_step
        self._granted = lru_cache(maxsize=256)(lambda command: limits.granted(command, config))
        self._stages = [Stage(-1, BOTH, start)]
        self._ahead: dict[int, list[Stage]] = {}  # what is expected from one step's command on
        self._moving = [STOP]  # the last command at which the walk went on, at each of these steps

    def asked(self, step: int) -> Command:
        """The command that is taken up at the start of step j, before its limits."""
        return self._commands(max(step, 0) * self.ticks * self.config.tick)

    def command(self, step: int) -> Command:
        """The same, as it is granted."""
        return self._granted(self.asked(step))

    def stage(self, step: int, known: int | None) -> Stage:
        """Step j; with `known`, as it is expected from the commands up to that step."""
        if step < -1:
            return self._stages[0]._replace(number=step)
        if known is not None and step > known + 1:
            return self._expected(step, known)
        while len(self._stages) < step + 2:
            last = self._stages[-1]
            command, moving = self.command(last.number), self._moving[-1]
            self._stages.append(self.walker.after(last, command, moving))
            self._moving.append(command if command.walks else moving)
        return self._stages[step + 1]

    def _expected(self, step: int, known: int) -> Stage:
        if known not in self._ahead:
            self._ahead.clear()
            self._ahead[known] = [self.stage(known + 1, None)]
        ahead, command = self._ahead[known], self.command(known)
        while len(ahead) < step - known:
            ahead.append(self.walker.after(ahead[-1], command, self._moving[known + 1]))
        return ahead[step - known - 1]


@dataclass(frozen=True)
class CommandedFootsteps(Footsteps):
    """Footsteps that follow commands. What a step commands of those after the next one is an expectation, see `seen`.

    Attributes:
        line: the steps under the commands.
        known: the step whose command is expected to hold from then on; None where all commands are known.
    """

    line: Line | None = None
    known: int | None = None

    @classmethod
    def of(
        cls, config: GaitConfig, commands: Callable[[float], Command], start: Pose, limits: Limits
    ) -> CommandedFootsteps:
        """The footsteps under the command that holds at each time [s], from a stand at `start`."""
        return cls((), (0.0, 0.0), config.stance_width, line=Line(config, commands, start, limits))

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

    def path(self, step: int) -> tuple[float, ...]:
        """See `Gait.path`."""
        this = self[step]
        across = this.side * self.width / 2.0
        middle = Pose(this.x, this.y, this.yaw).moved(0.0, -across)
        command = STOP if self.line is None or this.side == BOTH else self.line.command(step)
        return (*middle, *command)

    def settled(self, step: int) -> bool:
        """Whether the command of step j is that of the step before."""
        return self.line is None or self.line.command(step) == self.line.command(step - 1)

    def with_stride(self, stride: float, step: int) -> Footsteps:
        """Raises `InputError`: the stride follows from the commands."""
        raise InputError("commands: a walk that follows commands has no stride to change")

    def _before_the_end(self, step: int) -> Footstep:
        assert self.line is not None
        ticks, stage = self.line.ticks, self.line.stage(step, self.known)
        return Footstep(stage.side, *self.line.walker.foot(stage), 0.0, step * ticks, ticks)
