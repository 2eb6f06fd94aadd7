"""What can be commanded: how far legs reach in a step, and how far a foot turns before it meets the other one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from pdhocbf_drake.walking.commands import STOP, Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.sides import LEFT
from pdhocbf_drake.walking.sole_gap import Pose
from pdhocbf_drake.walking.walker import GAP, HALVINGS, WIDEST, Stage, Walker, foot, swing_gap

_LARGEST_TURN = 0.3  # of one step [rad]; from one way to the other a foot still passes beside the other one
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
        widest = config.stance_width / 2.0 + WIDEST
        fits = self._at_most(turn, lambda part: self._least_gap(fewer._replace(turn=part), config, widest))
        return fewer._replace(turn=fits)

    def aside(self, command: Command, config: GaitConfig) -> float:
        """Distance of the feet from the path in a walk at a granted command, so that its soles stay apart [m].

        Half of the stance width, or where the walk turns too sharply for that, the least more at which they do.
        """
        half = config.stance_width / 2.0
        if self._least_gap(command, config, half) >= GAP:
            return half
        less = self._at_most(WIDEST, lambda part: self._least_gap(command, config, half + WIDEST - part))
        return half + WIDEST - less

    @staticmethod
    def _at_most(whole: float, gap: Callable[[float], float]) -> float:
        """The largest part of a number at which a gap that shrinks with it is still `GAP`."""
        if gap(whole) >= GAP:
            return whole
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if gap(middle * whole) >= GAP else (low, middle)
        return low * whole

    def _least_gap(self, command: Command, config: GaitConfig, aside: float) -> float:
        """The least gap between the soles in a walk at this command, also where one passes the other [m]."""
        if self.sole is None or not command.turn:
            return math.inf
        walk, stage, feet = Walker(config, aside=lambda _: aside), Stage(0, LEFT, Pose(0.0, 0.0, 0.0), aside), []
        for _ in range(_AHEAD):
            feet.append(foot(stage))
            stage = walk.after(stage, command)
        return min(swing_gap(*three, self.sole) for three in zip(feet, feet[1:], feet[2:], strict=False))
