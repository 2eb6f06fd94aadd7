"""Planned headings of both soles and of the torso."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context

from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.gait_reference import ChangedGait
from pdhocbf_drake.systems.signals import size
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.swing import turned_heading


class TurnReference(Block):
    """Turns the swing foot from the heading of its last stance to that of its next one, and the torso half as far.

    The stance foot keeps its heading; that of the torso is the mean of both soles', so that it turns smoothly.

    Input ports:
        gait_phase (3), and those of `ChangedGait`.
    Output ports:
        turn_reference (9): as in `systems.signals`.
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self._tick = gait.config.tick
        self._phase = self.DeclareVectorInputPort("gait_phase", size("gait_phase"))
        self._gait = ChangedGait(self, gait)
        prerequisites = {self._phase.ticket(), *self._gait.tickets}
        self.DeclareVectorOutputPort("turn_reference", size("turn_reference"), weakly(self._calc), prerequisites)

    def _calc(self, context: Context, output: BasicVector) -> None:
        tick, step, _ = self._phase.Eval(context).tolist()
        output.SetFromVector(self.headings(tick, round(step), self._gait(context)))

    def headings(self, tick: float, step: int, gait: Gait) -> list[float]:
        """turn_reference at a tick of step j of the gait as it has been changed, (9,)."""
        begin = gait.lift_off(step)
        duration, time = (gait.period - begin) * self._tick, (tick - begin) * self._tick
        start_left, end_left, start_right, end_right = gait.foot_yaws(step)
        left = turned_heading(start_left, end_left, duration, time)
        right = turned_heading(start_right, end_right, duration, time)
        torso = [0.5 * (one + other) for one, other in zip(left, right, strict=True)]
        return [*left, *right, *torso]
