"""What a driver asks for at a tick, and what was asked for in a whole drive, as a scenario has it."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

from pdhocbf_drake.walking.barrier_changes import Kind
from pdhocbf_drake.walking.commands import STOP, Command

SIDES: Final = {
    "from behind": 0.0,
    "from the left": -0.5 * math.pi,
    "from the front": math.pi,
    "from the right": 0.5 * math.pi,
}
"""The direction of a push by where it comes from, from the heading on counter-clockwise [rad]."""
PUSH: Final = 0.1  # length of a push [s]
GAMMAS: Final = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Values of γ whose programs are compiled before a drive begins."""


class Pushed(NamedTuple):
    """A push from one of `SIDES`, with an impulse [N s]."""

    side: str
    impulse: float

    def force(self, heading: float) -> tuple[float, float, float]:
        """The force for `PUSH` on a robot of this heading [rad], in world axes [N]."""
        angle, size = heading + SIDES[self.side], self.impulse / PUSH
        return size * math.cos(angle), size * math.sin(angle), 0.0


class Kept(NamedTuple):
    """How a barrier is to be kept from then on, see `BarrierChange`; None leaves a part as it is."""

    name: str
    kind: Kind | None = None
    margin: float | None = None
    gamma: float | None = None

    def given(self) -> dict[str, Any]:
        """What is not None, by its name."""
        return {key: value for key, value in self._asdict().items() if value is not None}


class Asked(NamedTuple):
    """What a driver asks for at a tick.

    Attributes:
        command: that holds from then on.
        pushes: that begin then.
        barriers: that are to be kept in another way.
        paused: whether the walk is to wait.
        restarts, ends: whether it is to begin anew, or to end.
    """

    command: Command = STOP
    pushes: tuple[Pushed, ...] = ()
    barriers: tuple[Kept, ...] = ()
    paused: bool = False
    restarts: bool = False
    ends: bool = False


class Drive:
    """What a drive consists of so far, in the form of a scenario's keys.

    Attributes:
        commands, pushes, barrier_changes: entries of these keys.
    """

    def __init__(self) -> None:
        self.commands: list[dict[str, Any]] = []
        self.pushes: list[dict[str, Any]] = []
        self.barrier_changes: list[dict[str, Any]] = []
        self._last: Command | None = None

    def command(self, time: float, command: Command) -> bool:
        """Notes a command that holds from a time on [s]; returns whether it is another one than before.

        It takes the place of those from that time on, which were not read before it came.
        """
        if command == self._last:
            return False
        while self.commands and self.commands[-1]["time"] >= time:
            self.commands.pop()
        if command.walks:
            entry = {"time": time, "velocity": [command.forward, command.lateral], "turn": command.turn}
        else:
            entry = {"time": time, "stop": True}
        self.commands.append(entry)
        self._last = command
        return True

    def push(self, time: float, force: tuple[float, float, float]) -> None:
        """Notes a push that begins at a time [s]."""
        self.pushes.append({"time": time, "duration": PUSH, "force": list(force)})

    def keep(self, time: float, barrier: Kept) -> dict[str, Any]:
        """Notes how a barrier is kept from a time on [s]; returns the entry."""
        self.barrier_changes.append({"time": time, **barrier.given()})
        return self.barrier_changes[-1]
