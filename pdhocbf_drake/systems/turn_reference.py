"""Planned headings of both soles and of the torso."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from pdhocbf_drake.systems.gait_reference import gait_after
from pdhocbf_drake.systems.signals import size
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.swing import turned_heading


class TurnReference(LeafSystem):
    """Turns the swing foot from the heading of its last stance to that of its next one, and the torso half as far.

    The stance foot keeps its heading; that of the torso is the mean of both soles', so that it turns smoothly.

    Input ports:
        gait_phase (3).
        last_step (1), resumed (3): as in `systems.signals`; may be left unconnected.
    Output ports:
        turn_reference (9): as in `systems.signals`.
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self._gait, self._tick = gait, gait.config.tick
        ports = [self.DeclareVectorInputPort(name, size(name)) for name in ("gait_phase", "last_step", "resumed")]
        self._phase, self._last, self._resumed = ports
        prerequisites = {port.ticket() for port in ports}
        self.DeclareVectorOutputPort("turn_reference", size("turn_reference"), self._calc, prerequisites)

    def _calc(self, context: Context, output: BasicVector) -> None:
        tick, step, _ = self._phase.Eval(context).tolist()
        gait = gait_after(self._gait, self._last, self._resumed, context)
        begin = gait.lift_off(round(step))
        duration, time = (gait.period - begin) * self._tick, (tick - begin) * self._tick
        start_left, end_left, start_right, end_right = gait.foot_yaws(round(step))
        left = turned_heading(start_left, end_left, duration, time)
        right = turned_heading(start_right, end_right, duration, time)
        torso = [0.5 * (one + other) for one, other in zip(left, right, strict=True)]
        output.SetFromVector([*left, *right, *torso])
