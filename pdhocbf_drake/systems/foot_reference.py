"""Planned motion of both soles."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.gait_reference import changed_gait
from pdhocbf_drake.systems.optional_input import OptionalInput
from pdhocbf_drake.systems.signals import size
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.swing import Swing


class FootReference(Block):
    """Keeps the stance foot in place and moves the swing foot to its planned landing.

    The plan may move the landing at every tick. The swing foot continues from its reference of the last tick, which is
    this block's discrete state, so that its position, velocity and acceleration along the ground stay continuous. Its
    height above the ground is a function of the tick alone; on uneven ground that of the ground is added, see
    `Swing.put_on_ground`.

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
        resumed = self.DeclareVectorInputPort("resumed", size("resumed"))
        self._resumed = OptionalInput(resumed)
        self.DeclareDiscreteState(size("foot_reference"))
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._update)
        prerequisites = {self._phase.ticket(), self._plan.ticket(), resumed.ticket(), self.xd_ticket()}
        self._reference = self.DeclareVectorOutputPort(
            "foot_reference", size("foot_reference"), weakly(self._calc), prerequisites
        )

    def _update(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._reference.Eval(context))

    def _calc(self, context: Context, output: BasicVector) -> None:
        gait = changed_gait(self._gait, None, self._resumed(context), None)
        before = context.get_discrete_state_vector().value()
        output.SetFromVector(self.reference(self._phase.Eval(context), self._plan.Eval(context), before, gait))

    def reference(self, gait_phase: np.ndarray, plan: np.ndarray, before: np.ndarray, gait: Gait) -> np.ndarray:
        """foot_reference (18,) from that of the tick before; of the gait, its lift-off and ground count."""
        tick, step, support = gait_phase.tolist()
        phase, step = round(tick), round(step)
        if not gait.uneven:
            return self._swing.feet(phase, support, plan, before, gait.lift_off(step))
        profile = gait.profiles(step)[0]
        feet = self._swing.feet(phase, support, plan, before, gait.lift_off(step), profile)
        self._swing.put_on_ground(phase, support, gait.planes(step), feet, gait.lift_off(step), profile)
        return feet
