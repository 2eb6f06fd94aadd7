"""The clock of the walk."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.gait import Gait


class GaitReference(LeafSystem):
    """Counts ticks and says what the gait commands at this one.

    Its one discrete state is the tick k; like every block here it is updated at kδ, so that between kδ and
    (k + 1)δ its outputs speak of tick k + 1, the one that the robot is moving towards.

    Input ports:
        last_step (1): the step that the controller wants to be the last one, or −1; may be left unconnected.
    Output ports:
        gait_phase (3): tick of the step, step index, support (+1 left, −1 right, 0 both).
        com_height (3): z, ż, z̈ of eq. (24) [m, m/s, m/s²].
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self._gait = gait
        self._heights = [np.array(gait.height(tick)) for tick in range(gait.period)]
        self._last = self.DeclareVectorInputPort("last_step", 1)
        self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._advance)
        state = {self.xd_ticket()}
        self.DeclareVectorOutputPort("gait_phase", 3, self._phase, state | {self._last.ticket()})
        self.DeclareVectorOutputPort("com_height", 3, self._height, state)

    def _advance(self, context: Context, values: DiscreteValues) -> None:
        values.set_value([context.get_discrete_state_vector()[0] + 1.0])

    def _tick(self, context: Context) -> int:
        return round(context.get_discrete_state_vector()[0])

    def _phase(self, context: Context, output: BasicVector) -> None:
        step, tick = self._gait.phase(self._tick(context))
        gait = self._gait.ended_by(self._last.Eval(context)[0] if self._last.HasValue(context) else -1)
        output.SetFromVector([tick, step, gait.support(step)])

    def _height(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._heights[self._tick(context) % self._gait.period])
