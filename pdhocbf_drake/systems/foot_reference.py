"""Where both soles should be."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.swing import Swing


class FootReference(LeafSystem):
    """Stance foot where it is, swing foot on its way to where the plan now has it land.

    The plan may move the landing at every tick. The swing foot goes on from where it was sent at the last tick
    (this block's discrete state), so that a moved landing bends its way and never makes it jump. What it does above
    the ground is a function of the clock alone.

    Input ports:
        gait_phase (3); foot_plan (8): start and end of each foot in this step, see `mpc.memory.Memory` [m].
    Output ports:
        foot_reference (18): left then right sole: position, velocity, acceleration [m, m/s, m/s²].
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self._swing = Swing(gait)
        self._phase = self.DeclareVectorInputPort("gait_phase", 3)
        self._plan = self.DeclareVectorInputPort("foot_plan", 8)
        self.DeclareDiscreteState(18)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._remember)
        changes = {self._phase.ticket(), self._plan.ticket(), self.xd_ticket()}
        self._reference = self.DeclareVectorOutputPort("foot_reference", 18, self._calc, changes)

    def _remember(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._reference.Eval(context))

    def _calc(self, context: Context, output: BasicVector) -> None:
        tick, _, support = self._phase.Eval(context).tolist()
        before = context.get_discrete_state_vector().value()
        output.SetFromVector(self._swing.feet(round(tick), support, self._plan.Eval(context), before))
