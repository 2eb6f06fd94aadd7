"""Planned motion of both soles."""

from __future__ import annotations

from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.signals import size
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.footsteps import Resumed
from pdhocbf_drake.walking.swing import Swing


class FootReference(Block):
    """Keeps the stance foot in place and moves the swing foot to its planned landing.

    The plan may move the landing at every tick. The swing foot continues from its reference of the last tick, which is
    this block's discrete state, so that its position, velocity and acceleration along the ground stay continuous. Its
    height is a function of the tick alone.

    Input ports:
        gait_phase (3); foot_plan (8): start and end of each foot in this step [m].
        resumed (3): steps in place of a stand, as in `systems.signals`; may be left unconnected.
    Output ports:
        foot_reference (18): left then right sole: position, velocity, acceleration [m, m/s, m/s²].
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        self._gait, self._swing = gait, Swing(gait)
        self._phase = self.DeclareVectorInputPort("gait_phase", size("gait_phase"))
        self._plan = self.DeclareVectorInputPort("foot_plan", size("foot_plan"))
        self._resumed = self.DeclareVectorInputPort("resumed", size("resumed"))
        self.DeclareDiscreteState(size("foot_reference"))
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._update)
        prerequisites = {self._phase.ticket(), self._plan.ticket(), self._resumed.ticket(), self.xd_ticket()}
        self._reference = self.DeclareVectorOutputPort(
            "foot_reference", size("foot_reference"), weakly(self._calc), prerequisites
        )

    def _update(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._reference.Eval(context))

    def _calc(self, context: Context, output: BasicVector) -> None:
        tick, step, support = self._phase.Eval(context).tolist()
        gait = self._gait
        if self._resumed.HasValue(context):
            gait = gait.resumed_by(Resumed(*map(round, self._resumed.Eval(context).tolist())))
        before = context.get_discrete_state_vector().value()
        output.SetFromVector(
            self._swing.feet(round(tick), support, self._plan.Eval(context), before, gait.lift_off(round(step)))
        )
