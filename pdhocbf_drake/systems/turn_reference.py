"""Planned headings of both soles and of the torso."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.gait_reference import ChangedGait
from pdhocbf_drake.systems.signals import size
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.kernels import onward


class TurnReference(Block):
    """Turns the swing foot from the heading of its last stance to that of its next one, and the torso half as far.

    The stance foot keeps its heading; that of the torso is the mean of both soles', so that it turns smoothly. The
    swing foot turns with least jerk from its reference of the last tick, which is this block's discrete state, so that
    its heading has no jump where a disturbed walk turns no more.

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
        self.DeclareDiscreteState(size("turn_reference"))
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._update)
        prerequisites = {self._phase.ticket(), self.xd_ticket(), *self._gait.tickets}
        self._reference = self.DeclareVectorOutputPort(
            "turn_reference", size("turn_reference"), weakly(self._calc), prerequisites
        )

    def _update(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._reference.Eval(context))

    def _calc(self, context: Context, output: BasicVector) -> None:
        tick, step, _ = self._phase.Eval(context).tolist()
        before = context.get_discrete_state_vector().value()
        output.SetFromVector(self.headings(round(tick), round(step), before, self._gait(context)))

    def headings(self, tick: int, step: int, before: np.ndarray, gait: Gait) -> np.ndarray:
        """turn_reference (9,) at a tick of step j, from that of the tick before; of the gait as it has been changed."""
        aloft, remaining = tick - gait.lift_off(step), (gait.period - tick + 1) * self._tick
        yaws, soles = np.reshape(gait.foot_yaws(step), (2, 2)), np.zeros((2, 3))
        for sole, last, (start, end) in zip(soles, before.reshape(3, 3), yaws, strict=False):
            sole[0] = start
            if aloft > 0:
                yaw, rate, acceleration = last if aloft > 1 else (start, 0.0, 0.0)
                sole[:] = onward(yaw, rate, acceleration, end, remaining, self._tick)
        return np.concatenate([*soles, soles.mean(axis=0)])
