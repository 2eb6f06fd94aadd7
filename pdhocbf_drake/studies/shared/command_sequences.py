"""Random commands of a walk: another velocity and turn rate, or a stop, every so often."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from pydantic import Field, model_validator

from pdhocbf_drake.config import Config, parse_config, within
from pdhocbf_drake.yaml_text import read_yaml

CAMPAIGNS: Final = Path(__file__).resolve().parents[2] / "campaigns"
"""The folder of the campaigns that come with the package."""
_PACKAGED, _FACTOR = CAMPAIGNS / "walking_commands.yaml", "commands"

_Speed = Annotated[float, within(-10.0, 10.0, "m/s")]
_Turn = Annotated[float, within(-10.0, 10.0, "rad/s")]
_Hold = Annotated[float, within(0.01, 36000.0, "s")]


class CommandSequence(Config):
    """Random commands, each drawn evenly between its ends and independent of the one before.

    Attributes:
        forward, lateral: ends of the velocity along the heading and to its left [m/s].
        turn: ends of the turn rate [rad/s].
        hold: shortest and longest time for which a command holds [s].
        stops: share of the commands that are stops; the first one never is [1].
        until: no command begins at this time or later [s].
    """

    forward: tuple[_Speed, _Speed]
    lateral: tuple[_Speed, _Speed]
    turn: tuple[_Turn, _Turn]
    hold: tuple[_Hold, _Hold]
    stops: float = Field(0.0, ge=0, le=1)
    until: Annotated[float, within(0.0, 36000.0, "s", above=True)]

    @model_validator(mode="after")
    def _ends_in_order(self) -> CommandSequence:
        for name in ("forward", "lateral", "turn", "hold"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name}: the first end must not be above the second (given: {low:g} and {high:g})")
        return self

    def drawn(self, generator: np.random.Generator) -> list[dict[str, Any]]:
        """Commands as a scenario's `commands` holds them, from time 0 on."""
        found: list[dict[str, Any]] = []
        time = 0.0
        while time < self.until:
            velocity = [generator.uniform(*self.forward), generator.uniform(*self.lateral)]
            turn, stop = generator.uniform(*self.turn), generator.uniform() < self.stops
            if stop and found:
                found.append({"time": time, "stop": True})
            else:
                found.append({"time": time, "velocity": velocity, "turn": turn})
            time += generator.uniform(*self.hold)
        return found


def drawing(seed: int, draw: int) -> tuple[np.random.Generator, int]:
    """The generator of a draw of a sample with a seed, and the seed of the draw's own runs."""
    generator = np.random.default_rng([seed, draw])
    return generator, int(generator.integers(2**31))


def packaged_sequence() -> CommandSequence:
    """The sequences of the campaign `walking_commands`."""
    factor = read_yaml(_PACKAGED)["factors"][_FACTOR]
    return parse_config(CommandSequence, factor["sequence"], _PACKAGED.name)


def drawn_sequence(data: Mapping[str, Any], seed: int, draw: int) -> tuple[list[dict[str, Any]], float]:
    """The commands of a draw of a `CommandSequence` given as plain data, and the time at which they end [s].

    They are those of the same point of a campaign with this seed whose only factor it is.
    """
    sequence = parse_config(CommandSequence, dict(data), "sequence")
    return sequence.drawn(drawing(seed, draw)[0]), sequence.until
