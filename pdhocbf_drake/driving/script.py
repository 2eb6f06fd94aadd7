"""A driver that follows a file: `pdhocbf drive --script FILE` presses its own buttons."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from pdhocbf_drake.config import Config, Name, parse_config, within
from pdhocbf_drake.driving.controls import Asked, Kept, Pushed
from pdhocbf_drake.walking.barrier_changes import Kind
from pdhocbf_drake.walking.commands import STOP, Command
from pdhocbf_drake.yaml_text import read_yaml

_Speed = Annotated[float, within(-10.0, 10.0, "m/s")]
_ROUNDING = 1e-9  # [s]


class Press(Config):
    """What is pressed at a time; what is left out stays.

    Attributes:
        time: when [s].
        forward, sideways: the sliders of the velocity [m/s].
        turn: that of the turn rate [rad/s].
        walks: whether it walks where all of them are 0, in place, or stands.
        push: from where it is pushed.
        impulse: how hard [N s].
        barrier: the barrier that is kept in another way, by `kind`, `margin` and `gamma` as in `barrier_changes`.
    """

    time: float = Field(ge=0)
    forward: _Speed | None = None
    sideways: _Speed | None = None
    turn: Annotated[float, within(-10.0, 10.0, "rad/s")] | None = None
    walks: bool | None = None
    push: Literal["from behind", "from the left", "from the front", "from the right"] | None = None
    impulse: Annotated[float, within(0.0, 1e3, "N s")] = 5.0
    barrier: Name | None = None
    kind: Kind | None = None
    margin: Annotated[float, within(0.0, 1e3, "unit of h")] | None = None
    gamma: Annotated[float, within(0.0, 1.0, "1", above=True)] | None = None

    @model_validator(mode="after")
    def _of_a_barrier(self) -> Press:
        parts = [name for name in ("kind", "margin", "gamma") if getattr(self, name) is not None]
        if parts and self.barrier is None:
            raise ValueError(f"{parts[0]} is one of a barrier, which is not named: give barrier")
        if self.barrier is not None and not parts:
            raise ValueError("a barrier is kept in another way by kind, margin or gamma: give one of them")
        return self


class _File(Config):
    presses: tuple[Press, ...]


class Script:
    """The presses of a file, in the order of their times."""

    def __init__(self, presses: tuple[Press, ...], where: str = "presses") -> None:
        self._presses = sorted(presses, key=lambda press: press.time)
        self._where = {id(press): f"{where}.{number}" for number, press in enumerate(presses)}
        self._next, self._way, self._walks = 0, {"forward": 0.0, "sideways": 0.0, "turn": 0.0}, False

    @classmethod
    def read(cls, path: Path) -> Script:
        """The script of a YAML file with a list `presses`; raises `InputError`."""
        data = read_yaml(path)
        return cls(parse_config(_File, data, str(path)).presses, f"{path}.presses")

    def barriers(self) -> list[tuple[str, float, Kept]]:
        """Where each change of a barrier is in the file, its time [s], and the change, in the order of their times."""
        return [(self._where[id(press)], press.time, kept) for press in self._presses if (kept := _kept(press))]

    def after(self, end: float) -> list[str]:
        """Where each press is in the file that is not before the end of a drive [s], and its time."""
        return [f"{self._where[id(press)]} at {press.time:g} s" for press in self._presses if press.time >= end]

    def at(self, time: float) -> Asked:
        """What is asked for at a time [s], which must not decrease from call to call."""
        pushes, barriers = [], []
        while self._next < len(self._presses) and self._presses[self._next].time <= time + _ROUNDING:
            press = self._presses[self._next]
            self._next += 1
            self._way |= {name: value for name in self._way if (value := getattr(press, name)) is not None}
            self._walks = self._walks if press.walks is None else press.walks
            if press.push is not None:
                pushes.append(Pushed(press.push, press.impulse))
            if (kept := _kept(press)) is not None:
                barriers.append(kept)
        ahead, aside, turn = self._way.values()
        command = Command(ahead, aside, turn) if self._walks or any(self._way.values()) else STOP
        return Asked(command, tuple(pushes), tuple(barriers))


def _kept(press: Press) -> Kept | None:
    return None if press.barrier is None else Kept(press.barrier, press.kind, press.margin, press.gamma)
