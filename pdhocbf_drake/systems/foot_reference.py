"""Where both soles should be."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.gait import Gait, swing_onward, swing_point


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
        self._gait = gait
        phase = self.DeclareVectorInputPort("gait_phase", 3)
        plan = self.DeclareVectorInputPort("foot_plan", 8)
        self.DeclareDiscreteState(18)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._remember)
        changes = {phase.ticket(), plan.ticket(), self.xd_ticket()}
        self.DeclareVectorOutputPort("foot_reference", 18, self._calc, changes)

    def _remember(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self.GetOutputPort("foot_reference").Eval(context))

    def _calc(self, context: Context, output: BasicVector) -> None:
        config = self._gait.config
        tick, _, support = self.GetInputPort("gait_phase").Eval(context)
        plan = self.GetInputPort("foot_plan").Eval(context).reshape(2, 2, 2)
        last = context.get_discrete_state_vector().value().reshape(2, 3, 3)
        duration = self._gait.swing_ticks() * config.tick
        time = (tick - config.double_support_ticks) * config.tick
        feet = np.zeros((2, 3, 3))  # foot, derivative, axis
        for foot, side, (start, end), before in zip(feet, (1, -1), plan, last, strict=True):
            if support != -side or time <= 0.0:
                foot[0, :2] = start
                continue
            lifts_off = time < 1.5 * config.tick
            now = np.array([start, np.zeros(2), np.zeros(2)]) if lifts_off else before[:, :2]
            foot[:, :2] = swing_onward(now, end, duration - time + config.tick, config.tick)
            above = swing_point(np.zeros(2), np.zeros(2), config.swing_height, duration, time)
            foot[:, 2] = [above.position[2], above.velocity[2], above.acceleration[2]]
        output.SetFromVector(feet.ravel())
