"""What the swinging legs do to the ZMP, which a point mass can't know."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.swing import Swing

_RATE = 0.5  # how much of a new step goes into the table [1]
_FEET = {"foot_reference": 18, "foot_plan": 8, "stance_plan": 8}
_NO_FEET = np.zeros(18)
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
        self._swing = Swing(gait)
        along, aside = (0.0, 0.0) if lever is None else np.asarray(lever, dtype=float).tolist()
        self._lever = (along, aside)
        self._pushed = any(self._lever)
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
            reference = self._foot_reference.Eval(context) if self._pushed else _NO_FEET
            _learn(round(tick), support, self._seen.Eval(context), self._planned.Eval(context), reference, self._lever,
                   table)  # fmt: skip
        values.set_value(table)

    def _calc(self, context: Context, output: BasicVector) -> None:
        tick, step, _ = self._phase.Eval(context).tolist()
        last = self._last.Eval(context)[0] if self._last.HasValue(context) else -1.0
        here = slice(round(tick) + 1, round(tick) + 1 + self._horizon)
        side, expected = self._sides(round(step), last)[here], np.empty((2, self._horizon))
        _repeat(round(tick), side, context.get_discrete_state_vector().value(), expected)
        if self._pushed:
            reference = self._foot_reference.Eval(context).reshape(2, 3, 3)
            plan = self._foot_plan.Eval(context).reshape(2, 2, 2)
            after = self._stance_plan.Eval(context)[6:]
            self._swing.add_accelerations(
                round(tick), side, reference, plan, after, self._lever, _LARGEST_SWING, expected
            )
        output.SetFromVector(expected.ravel())

    def _sides_from(self, step: int, last_step: float) -> np.ndarray:
        """The foot that stands at each tick from the start of a step on: +1 left, −1 right, 0 both."""
        gait = self._gait.ended_by(last_step)
        steps = range(step, step + self._horizon // self._period + 2)
        return np.repeat([float(gait.support(index)) for index in steps], self._period)


@compiled
def _repeat(phase: int, side: np.ndarray, table: np.ndarray, out: np.ndarray) -> None:
    """The table (2 N,) from the next tick on, on the side where each step stands, none in a stand."""
    period = len(table) // 2
    for i in range(len(side)):
        place = (phase + 1 + i) % period
        out[0, i] = table[place] * abs(side[i])
        out[1, i] = table[period + place] * side[i]


@compiled
def _learn(
    phase: int, support: float, seen: np.ndarray, planned: np.ndarray, feet: np.ndarray, lever: tuple[float, float],
    table: np.ndarray,
) -> None:  # fmt: skip
    """Takes in what this tick's ZMP differs by, less what the swing foot explains; what is not finite is left out."""
    period = len(table) // 2
    foot = 9 if support > 0.0 else 0  # the one that swings
    ahead = seen[0] - planned[0] - lever[0] * feet[foot + 6]
    aside = (seen[1] - planned[2] - lever[1] * feet[foot + 7]) * support
    if math.isfinite(ahead) and math.isfinite(aside):
        table[phase] += _RATE * (min(max(ahead, -_LARGEST), _LARGEST) - table[phase])
        table[period + phase] += _RATE * (min(max(aside, -_LARGEST), _LARGEST) - table[period + phase])
