"""What the swinging legs do to the ZMP, which a point mass can't know."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.gait import Gait
from pdhocbf_drake.gait.forecast import SwingForecast

_RATE = 0.5  # how much of a new step goes into the table [1]
_FEET = {"foot_reference": 18, "foot_plan": 8, "stance_plan": 8}
_LARGEST_SWING = 0.12  # [m]
_LARGEST = 0.08  # [m]: more is not a swinging leg but a fall


class ZmpOffset(LeafSystem):
    """Expects where all links together will put the ZMP against where the template has it.

    The difference is the legs' angular momentum, −Ḣ/(m (g + z̈)), by which the controller moves its ZMP box:

        offset(k) = table(phase of k) + lever · (acceleration of the swing foot at k)

    The second term is known from the plan, whatever step is planned. The rest repeats every step, mirrored in y, and
    is learned: the table (2 axes, N ticks, as seen on the left foot) is the discrete state.

    Input ports:
        gait_phase (3), whole_body_zmp (2), zmp_reference (4), foot_reference (18), foot_plan (8), stance_plan (8);
            the last three are needed where there is a lever.
        last_step (1): the step after which the walk comes to a stand, else −1; may be left unconnected.
    Output ports:
        zmp_offset (2 H): expected whole-body minus template ZMP at the next H ticks, x then y [m].

    Args:
        gait: the walk. horizon: H [ticks].
        lever: see `biped.swing_lever` (2,) [s²]; null leaves all to the table.
    """

    def __init__(self, gait: Gait, horizon: int, lever: np.ndarray | None = None) -> None:
        super().__init__()
        self._gait, self._period, self._horizon = gait, gait.period, horizon
        self._swing = SwingForecast(gait, horizon)
        self._lever = np.zeros(2) if lever is None else np.asarray(lever, dtype=float)
        phase = self.DeclareVectorInputPort("gait_phase", 3)
        self.DeclareVectorInputPort("whole_body_zmp", 2)
        self.DeclareVectorInputPort("zmp_reference", 4)
        feet = [self.DeclareVectorInputPort(name, size) for name, size in _FEET.items()]
        last = self.DeclareVectorInputPort("last_step", 1)
        self.DeclareDiscreteState(2 * self._period)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._learn)
        changes = {self.xd_ticket(), *(port.ticket() for port in (phase, last, *feet))}
        self.DeclareVectorOutputPort("zmp_offset", 2 * horizon, self._calc, changes)

    def _learn(self, context: Context, values: DiscreteValues) -> None:
        tick, _, support = self.GetInputPort("gait_phase").Eval(context)
        table = context.get_discrete_state_vector().value().reshape(2, -1).copy()
        planned = self.GetInputPort("zmp_reference").Eval(context)[[0, 2]]
        seen = self.GetInputPort("whole_body_zmp").Eval(context) - planned
        if support and self._lever.any():
            swinging = self.GetInputPort("foot_reference").Eval(context).reshape(2, 3, 3)[1 if support > 0 else 0]
            seen = seen - self._lever * swinging[2, :2]
        seen = seen * [1.0, support]
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
        repeats = np.stack([np.abs(side) * table[0, ticks], side * table[1, ticks]])
        if not self._lever.any():
            output.SetFromVector(repeats.ravel())
            return
        reference = self.GetInputPort("foot_reference").Eval(context).reshape(2, 3, 3)
        plan = self.GetInputPort("foot_plan").Eval(context).reshape(2, 2, 2)
        after = self.GetInputPort("stance_plan").Eval(context)[6:]
        swing = self._swing.accelerations(round(tick), side, reference, plan, after)
        moved = np.clip(self._lever[:, None] * swing, -_LARGEST_SWING, _LARGEST_SWING)
        output.SetFromVector((repeats + moved).ravel())
