"""The clock of the walk."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.systems.signals import size, sizes
from pdhocbf_drake.walking import Gait


class GaitReference(LeafSystem):
    """Counts ticks and outputs what the gait commands for the present one.

    Its one discrete state is the tick k. Like every block here it is updated at kδ, so that its outputs between kδ and
    (k + 1)δ are those of tick k + 1, towards which the robot moves.

    Input ports:
        last_step (1): the step with the last swing, or −1; may be left unconnected.
    Output parts, see `unbundled`:
        gait_phase (3): tick of the step, step index, support (+1 left, −1 right, 0 both).
        com_height (3): z, ż, z̈ of eq. (24) [m, m/s, m/s²].
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self.parts = sizes("gait_phase", "com_height")
        self._gait = gait
        self._heights = [gait.height(tick) for tick in range(gait.period)]
        self._last = self.DeclareVectorInputPort("last_step", size("last_step"))
        self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._advance)
        prerequisites = {self.xd_ticket(), self._last.ticket()}
        self.DeclareVectorOutputPort("commanded", sum(self.parts.values()), self._calc, prerequisites)

    def _advance(self, context: Context, values: DiscreteValues) -> None:
        values.set_value([context.get_discrete_state_vector()[0] + 1.0])

    def _calc(self, context: Context, output: BasicVector) -> None:
        step, tick = self._gait.phase(round(context.get_discrete_state_vector()[0]))
        gait = self._gait.ended_by(self._last.Eval(context)[0] if self._last.HasValue(context) else -1)
        output.SetFromVector([tick, step, gait.support(step), *self._heights[tick]])
