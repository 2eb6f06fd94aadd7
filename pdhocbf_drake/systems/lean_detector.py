"""Ends a run when the template has fallen."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Context, EventStatus, LeafSystem


class LeanDetector(LeafSystem):
    """Watches how far the pendulum leans: a CoM farther from the ZMP than it is high (45°) ends the run.

    In single support a walk leans by less than half a step; no foothold within a leg's reach stops a lean of 45°.

    Input ports:
        lip_state (6): c, v, p of x, then of y [m, m/s, m].
    """

    def __init__(self, height: float, tick: float) -> None:
        super().__init__()
        self._height = height
        self.DeclareVectorInputPort("lip_state", 6)
        self.DeclarePeriodicPublishEvent(tick, 0.0, self._watch)

    def _watch(self, context: Context) -> EventStatus:
        x, _, x_zmp, y, _, y_zmp = self.GetInputPort("lip_state").Eval(context)
        lean = np.hypot(x - x_zmp, y - y_zmp)
        if lean <= self._height:  # false for NaN as well
            return EventStatus.Succeeded()
        return EventStatus.ReachedTermination(self, f"fell: the CoM is {lean:.2f} m beside the ZMP")
