"""The clock of the walk."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.systems.unbundled import Unbundled
from pdhocbf_drake.walking import Gait


class GaitReference(Unbundled):
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
        super().__init__(_GaitReference(gait), {"gait_phase": 3, "com_height": 3})


class _GaitReference(LeafSystem):
    """`GaitReference` with one output."""

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self._gait = gait
        self._heights = [gait.height(tick) for tick in range(gait.period)]
        self._last = self.DeclareVectorInputPort("last_step", 1)
        self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._advance)
        self.DeclareVectorOutputPort("commanded", 6, self._calc, {self.xd_ticket(), self._last.ticket()})

    def _advance(self, context: Context, values: DiscreteValues) -> None:
        values.set_value([context.get_discrete_state_vector()[0] + 1.0])

    def _calc(self, context: Context, output: BasicVector) -> None:
        step, tick = self._gait.phase(round(context.get_discrete_state_vector()[0]))
        gait = self._gait.ended_by(self._last.Eval(context)[0] if self._last.HasValue(context) else -1)
        output.SetFromVector([tick, step, gait.support(step), *self._heights[tick]])
