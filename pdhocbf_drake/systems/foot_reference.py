"""Planned motion of both soles."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.systems.signals import size
from pdhocbf_drake.walking import Gait, swing_point
from pdhocbf_drake.walking.swing import write_feet


class FootReference(LeafSystem):
    """Keeps the stance foot in place and moves the swing foot to its planned landing.

    The plan may move the landing at every tick. The swing foot continues from its reference of the last tick, which is
    this block's discrete state, so that its position, velocity and acceleration along the ground stay continuous. Its
    height is a function of the tick alone.

    Input ports:
        gait_phase (3); foot_plan (8): start and end of each foot in this step [m].
    Output ports:
        foot_reference (18): left then right sole: position, velocity, acceleration [m, m/s, m/s²].
    """

    def __init__(self, gait: Gait) -> None:
        super().__init__()
        config = gait.config
        self._tick, self._lifted = config.tick, config.double_support_ticks
        self._duration = gait.swing_ticks() * config.tick
        ground = np.zeros(2)
        swing = [
            swing_point(ground, ground, config.swing_height, self._duration, (tick - self._lifted) * config.tick)
            for tick in range(gait.period + 1)
        ]
        # The swing foot's height and its derivatives at each tick of a step, (N + 1, 3).
        self._above = np.array([[part[2] for part in point] for point in swing])
        self._phase = self.DeclareVectorInputPort("gait_phase", size("gait_phase"))
        self._plan = self.DeclareVectorInputPort("foot_plan", size("foot_plan"))
        self._size = size("foot_reference")
        self.DeclareDiscreteState(self._size)
        self.DeclarePeriodicDiscreteUpdateEvent(config.tick, 0.0, self._update)
        prerequisites = {self._phase.ticket(), self._plan.ticket(), self.xd_ticket()}
        self._reference = self.DeclareVectorOutputPort("foot_reference", self._size, self._calc, prerequisites)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._reference.Eval(context))

    def _calc(self, context: Context, output: BasicVector) -> None:
        tick, _, support = self._phase.Eval(context).tolist()
        aloft = round(tick) - self._lifted  # ticks since lift-off
        swinging = -1 if not support else 1 if support > 0 else 0
        before, feet = context.get_discrete_state_vector().value(), np.empty(self._size)
        remaining, above = self._duration - (aloft - 1) * self._tick, self._above[round(tick)]
        write_feet(swinging, aloft, self._plan.Eval(context), before, above, remaining, self._tick, feet)
        output.SetFromVector(feet)
