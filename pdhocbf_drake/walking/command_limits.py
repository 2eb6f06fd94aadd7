"""What can be commanded: how far legs reach in a step, and how far a foot turns before it meets the other one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from pdhocbf_drake.walking.commands import STOP, Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.sides import LEFT
from pdhocbf_drake.walking.sole_gap import Pose, sole_gap
from pdhocbf_drake.walking.walker import Stage, Walker

_LEAST_GAP = 0.012  # between soles as commanded [m]; walks come 2 mm closer
_LARGEST_TURN = 0.4  # of one step [rad]
_HALVINGS = 12
_SAMPLES = 5  # of a swing, at which the passing sole is checked
_AHEAD = 4


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
