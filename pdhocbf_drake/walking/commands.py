"""Commands of a walk as data: velocity and turn rate, or a stop, each from a time on."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from pydantic import Field, model_validator

from pdhocbf_drake.config import Config, within

_Speed = Annotated[float, within(-10.0, 10.0, "m/s")]
_ROUNDING = 1e-9  # [s]


class Command(NamedTuple):
    """What a walk is commanded to do; a walk at velocity 0 steps in place, one that stops stands.

    Attributes:
        forward, lateral: velocity along the heading and to its left [m/s].
        turn: turn rate, counter-clockwise seen from above [rad/s].
        walks: False for a stand.
    """

    forward: float = 0.0
    lateral: float = 0.0
    turn: float = 0.0
    walks: bool = True


STOP = Command(walks=False)


def read_late(phase: int, period: int) -> bool:
    """Whether a command that is given at tick q of a step of N ticks is read in the next step only, unless it stops.

    The last eighth of a step is for what the coming command needs, which is made a part a tick.
    """
    return 8 * phase > 7 * period


class CommandConfig(Config):
    """A command that holds from its time on until the next one.

    A walk takes it up at the first touchdown from then on: it changes the foothold after that, and a stop has two more
    steps from there.

    Attributes:
        time: from when on [s].
        velocity: along the heading and to its left [m/s].
        turn: turn rate, counter-clockwise seen from above [rad/s].
        stop: come to a stand, feet side by side.
    """

    time: float = Field(ge=0)
    velocity: tuple[_Speed, _Speed] = (0.0, 0.0)
    turn: Annotated[float, within(-10.0, 10.0, "rad/s")] = 0.0
    stop: bool = False

    @model_validator(mode="after")
    def _one_of_both(self) -> CommandConfig:
        given = {"velocity", "turn"} & self.model_fields_set
        if self.stop and (any(self.velocity) or self.turn):
            raise ValueError("a command that stops has neither a velocity nor a turn rate")
        if not self.stop and not given:
            raise ValueError("a command needs a velocity [m/s], a turn rate [rad/s] or stop: true")
        return self

    @property
    def command(self) -> Command:
        """The same without its time."""
        return STOP if self.stop else Command(*self.velocity, self.turn)


class Schedule:
    """Which of several commands holds at a time; a stand before the first one.

    Args:
        times: growing [s].
        commands: one for each time.
    """

    def __init__(self, times: Sequence[float], commands: Sequence[Command]) -> None:
        self._times, self._commands = [*times], [*commands]

    def __call__(self, time: float) -> Command:
        """The command that holds at a time [s]."""
        place = bisect_right(self._times, time + _ROUNDING)
        return self._commands[place - 1] if place else STOP
