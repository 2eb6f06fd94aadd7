"""Ends a run when the robot has fallen."""

from __future__ import annotations

import math

from pydrake.systems.framework import Context, EventStatus, LeafSystem

FALLEN = "fell: the CoM is below"
_FRACTION = 0.7  # of the nominal CoM height


class FallDetector(LeafSystem):
    """Watches the CoM height once a tick; a height below 70 % of nominal, or one that is not finite, ends the run.

    Input ports:
        com_z (2) [m, m/s].
    """

    def __init__(self, nominal: float, tick: float) -> None:
        super().__init__()
        self._least = _FRACTION * nominal
        self._com_z = self.DeclareVectorInputPort("com_z", 2)
        self.DeclarePeriodicPublishEvent(tick, 0.0, self._watch)

    def _watch(self, context: Context) -> EventStatus:
        height = self._com_z.Eval(context)[0]
        if math.isfinite(height) and height > self._least:
            return EventStatus.Succeeded()
        return EventStatus.ReachedTermination(self, f"{FALLEN} {self._least:.2f} m")
