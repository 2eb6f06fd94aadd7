"""Where both soles should be."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from pdhocbf_drake.gait import Gait, swing_point


class FootReference(LeafSystem):
    """Stance foot where it is, swing foot on its way, as functions of the clock and the plan alone.

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
        self.DeclareVectorOutputPort("foot_reference", 18, self._calc, {phase.ticket(), plan.ticket()})

    def _calc(self, context: Context, output: BasicVector) -> None:
        config = self._gait.config
        tick, _, support = self.GetInputPort("gait_phase").Eval(context)
        plan = self.GetInputPort("foot_plan").Eval(context).reshape(2, 2, 2)
        duration = self._gait.swing_ticks() * config.tick
        time = (tick - config.double_support_ticks) * config.tick
        parts = []
        for side, (start, end) in zip((1, -1), plan, strict=True):
            swings = support == -side
            height = config.swing_height if swings else 0.0
            point = swing_point(start, end if swings else start, height, duration, time)
            parts.append(np.concatenate(point))
        output.SetFromVector(np.concatenate(parts))
