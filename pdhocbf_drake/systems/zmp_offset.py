"""What the swinging legs do to the ZMP, which a point mass can't know."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.gait import Gait

_RATE = 0.3  # how much of a new gait goes into the table [1]
_LARGEST = 0.04  # [m]: more is not a swinging leg but a fall


class ZmpOffset(LeafSystem):
    """Learns, per tick of the gait, where all links together put the ZMP against where the template has it.

    The difference is the legs' angular momentum, −Ḣ/(m (g + z̈)): it repeats with the gait, so that the controller
    can move its ZMP box by it. The table (2 axes, 2N ticks) is the discrete state.

    Input ports:
        gait_phase (3), whole_body_zmp (2), zmp_reference (4).
    Output ports:
        zmp_offset (2 H): expected whole-body minus template ZMP at the next H ticks, x then y [m].
    """

    def __init__(self, gait: Gait, horizon: int) -> None:
        super().__init__()
        self._gait, self._horizon = gait, horizon
        self._cycle = gait.config.ticks_per_gait
        phase = self.DeclareVectorInputPort("gait_phase", 3)
        self.DeclareVectorInputPort("whole_body_zmp", 2)
        self.DeclareVectorInputPort("zmp_reference", 4)
        self.DeclareDiscreteState(2 * self._cycle)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._learn)
        self.DeclareVectorOutputPort("zmp_offset", 2 * horizon, self._calc, {self.xd_ticket(), phase.ticket()})

    def _place(self, context: Context) -> tuple[int, int]:
        """Support and tick of the gait."""
        tick, step, support = self.GetInputPort("gait_phase").Eval(context)
        return round(support), round(step * self._gait.period + tick) % self._cycle

    def _learn(self, context: Context, values: DiscreteValues) -> None:
        support, place = self._place(context)
        table = context.get_discrete_state_vector().value().reshape(2, -1).copy()
        if support:
            planned = self.GetInputPort("zmp_reference").Eval(context)[[0, 2]]
            seen = self.GetInputPort("whole_body_zmp").Eval(context) - planned
            if np.all(np.isfinite(seen)):
                table[:, place] += _RATE * (np.clip(seen, -_LARGEST, _LARGEST) - table[:, place])
        values.set_value(table.ravel())

    def _calc(self, context: Context, output: BasicVector) -> None:
        support, place = self._place(context)
        table = context.get_discrete_state_vector().value().reshape(2, -1)
        ahead = (place + 1 + np.arange(self._horizon)) % self._cycle
        output.SetFromVector((table[:, ahead] if support else np.zeros((2, self._horizon))).ravel())
