"""The clock of the walk."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, InputPort, LeafSystem

from pdhocbf_drake.systems.signals import size, sizes
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.footsteps import Resumed


def gait_after(gait: Gait, last_step: InputPort, resumed: InputPort, context: Context) -> Gait:
    """The gait as the controller has changed it, by the values of two input ports that may be left unconnected."""
    if last_step.HasValue(context):
        gait = gait.ended_by(last_step.Eval(context)[0])
    return gait.resumed_by(Resumed(*map(round, resumed.Eval(context).tolist()))) if resumed.HasValue(context) else gait


class GaitReference(LeafSystem):
    """Counts ticks and outputs what the gait commands for the present one.

    Its one discrete state is the tick k. Like every block here it is updated at kδ, so that its outputs between kδ and
    (k + 1)δ are those of tick k + 1, towards which the robot moves.

    Input ports:
        last_step (1): the step with the last swing, or −1; may be left unconnected.
        resumed (3): steps in place of a stand, as in `systems.signals`; may be left unconnected.
    Output parts, see `unbundled`:
        gait_phase (3): tick of the step, step index, support (+1 left, −1 right, 0 both).
        com_height (3): z, ż, z̈ of eq. (24) [m, m/s, m/s²].
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self.parts = sizes("gait_phase", "com_height")
        self._gait = gait
        self._commanded = np.array([[tick, 0.0, 0.0, *gait.height(tick)] for tick in range(gait.period)])
        self._last = self.DeclareVectorInputPort("last_step", size("last_step"))
        self._resumed = self.DeclareVectorInputPort("resumed", size("resumed"))
        self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._advance)
        prerequisites = {self.xd_ticket(), self._last.ticket(), self._resumed.ticket()}
        self.DeclareVectorOutputPort("commanded", sum(self.parts.values()), self._calc, prerequisites)

    def _advance(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(context.get_discrete_state_vector().value() + 1.0)

    def _calc(self, context: Context, output: BasicVector) -> None:
        step, tick = self._gait.phase(round(context.get_discrete_state_vector()[0]))
        gait = gait_after(self._gait, self._last, self._resumed, context)
        commanded = self._commanded[tick].copy()
        commanded[1], commanded[2] = step, gait.support(step)
        output.SetFromVector(commanded)
