"""What the swinging legs do to the ZMP, which a point mass can't know."""

from __future__ import annotations

import math
from functools import lru_cache

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
        self._pushed = bool(self._lever.any())
        self._sides = lru_cache(maxsize=4)(self._sides_from)
        self._phase = self.DeclareVectorInputPort("gait_phase", 3)
        self._seen = self.DeclareVectorInputPort("whole_body_zmp", 2)
        self._planned = self.DeclareVectorInputPort("zmp_reference", 4)
        feet = [self.DeclareVectorInputPort(name, size) for name, size in _FEET.items()]
        self._foot_reference, self._foot_plan, self._stance_plan = feet
        self._last = self.DeclareVectorInputPort("last_step", 1)
        self.DeclareDiscreteState(2 * self._period)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._learn)
        changes = {self.xd_ticket(), *(port.ticket() for port in (self._phase, self._last, *feet))}
        self.DeclareVectorOutputPort("zmp_offset", 2 * horizon, self._calc, changes)

    def _learn(self, context: Context, values: DiscreteValues) -> None:
        tick, _, support = self._phase.Eval(context).tolist()
        table = context.get_discrete_state_vector().value().copy()
        if support:
            x, _, y, _ = self._planned.Eval(context).tolist()
            seen_x, seen_y = self._seen.Eval(context).tolist()
            ahead, aside = seen_x - x, seen_y - y
            if self._pushed:
                foot = self._foot_reference.Eval(context)[9:] if support > 0 else self._foot_reference.Eval(context)
                ahead -= self._lever[0] * foot[6]
                aside -= self._lever[1] * foot[7]
            if math.isfinite(ahead) and math.isfinite(aside):
                for place, seen in ((round(tick), ahead), (round(tick) + self._period, aside * support)):
                    table[place] += _RATE * (min(max(seen, -_LARGEST), _LARGEST) - table[place])
        values.set_value(table)

    def _calc(self, context: Context, output: BasicVector) -> None:
        tick, step, _ = self._phase.Eval(context).tolist()
        last = self._last.Eval(context)[0] if self._last.HasValue(context) else -1.0
        here = slice(round(tick) + 1, round(tick) + 1 + self._horizon)
        side = self._sides(round(step), last)[here]
        table = context.get_discrete_state_vector().value().reshape(2, -1)
        expected = np.tile(table, len(self._sides(round(step), last)) // self._period)[:, here]
        expected[0] *= np.abs(side)
        expected[1] *= side
        if self._pushed:
            reference = self._foot_reference.Eval(context).reshape(2, 3, 3)
            plan = self._foot_plan.Eval(context).reshape(2, 2, 2)
            after = self._stance_plan.Eval(context)[6:]
            moved = self._swing.accelerations(round(tick), side, reference, plan, after)
            moved *= self._lever[:, None]
            expected += np.minimum(np.maximum(moved, -_LARGEST_SWING), _LARGEST_SWING)
        output.SetFromVector(expected.ravel())

    def _sides_from(self, step: int, last_step: float) -> np.ndarray:
        """The foot that stands at each tick from the start of a step on: +1 left, −1 right, 0 both."""
        gait = self._gait.ended_by(last_step)
        steps = range(step, step + self._horizon // self._period + 2)
        return np.repeat([float(gait.support(index)) for index in steps], self._period)
