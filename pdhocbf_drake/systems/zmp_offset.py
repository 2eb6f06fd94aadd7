"""What the swinging legs do to the ZMP, which a point mass can't know."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.gait import Gait

_RATE = 0.5  # how much of a new step goes into the table [1]
_LARGEST = 0.08  # [m]: more is not a swinging leg but a fall


class ZmpOffset(LeafSystem):
    """Learns, per tick of the step, where all links together put the ZMP against where the template has it.

    The difference is the legs' angular momentum, −Ḣ/(m (g + z̈)): it repeats every step, mirrored in y, so that the
    controller can move its ZMP box by it. The table (2 axes, N ticks, as seen on the left foot) is the discrete state.

    Input ports:
        gait_phase (3), whole_body_zmp (2), zmp_reference (4).
        last_step (1): the step after which the walk comes to a stand, else −1; may be left unconnected.
    Output ports:
        zmp_offset (2 H): expected whole-body minus template ZMP at the next H ticks, x then y [m].
    """

    def __init__(self, gait: Gait, horizon: int) -> None:
        super().__init__()
        self._gait, self._period, self._horizon = gait, gait.period, horizon
        phase = self.DeclareVectorInputPort("gait_phase", 3)
        self.DeclareVectorInputPort("whole_body_zmp", 2)
        self.DeclareVectorInputPort("zmp_reference", 4)
        last = self.DeclareVectorInputPort("last_step", 1)
        self.DeclareDiscreteState(2 * self._period)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._learn)
        self.DeclareVectorOutputPort(
            "zmp_offset", 2 * horizon, self._calc, {self.xd_ticket(), phase.ticket(), last.ticket()}
        )

    def _learn(self, context: Context, values: DiscreteValues) -> None:
        tick, _, support = self.GetInputPort("gait_phase").Eval(context)
        table = context.get_discrete_state_vector().value().reshape(2, -1).copy()
        planned = self.GetInputPort("zmp_reference").Eval(context)[[0, 2]]
        seen = (self.GetInputPort("whole_body_zmp").Eval(context) - planned) * [1.0, support]
        if support and np.all(np.isfinite(seen)):
            column = table[:, round(tick)]
            column += _RATE * (np.clip(seen, -_LARGEST, _LARGEST) - column)
        values.set_value(table.ravel())

    def _calc(self, context: Context, output: BasicVector) -> None:
        tick, step, _ = self.GetInputPort("gait_phase").Eval(context)
        port = self.GetInputPort("last_step")
        gait = self._gait.ended_by(port.Eval(context)[0] if port.HasValue(context) else -1)
        table = context.get_discrete_state_vector().value().reshape(2, -1)
        steps, ticks = np.divmod(round(tick) + 1 + np.arange(self._horizon), self._period)
        side = np.array([gait.support(round(step) + ahead) for ahead in range(steps[-1] + 1)])[steps]
        output.SetFromVector(np.concatenate([np.abs(side) * table[0, ticks], side * table[1, ticks]]))
