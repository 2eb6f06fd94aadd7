"""The ZMP offset that the swinging legs cause, which the point mass of the template does not model."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.gait_reference import ChangedGait
from pdhocbf_drake.systems.kernels import update_table, write_table_offset
from pdhocbf_drake.systems.signals import size, stretch
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.swing import Swing

_INPUTS = "gait_phase", "whole_body_zmp", "zmp_reference", "foot_reference", "foot_plan", "stance_plan"
STANCE_AFTER = stretch("stance_plan", "x_after", "y_after")
AT_REST = np.zeros(size("foot_reference"))
_LARGEST = 0.08 / 0.58  # learned offset, over the CoM's height: a larger difference is a fall, not a swinging leg
_LARGEST_SWING = 0.12 / 0.58  # offset that a swing foot is expected to cause, likewise


class ZmpOffset(Block):
    """Predicts the difference between the ZMP of all links and that of the template over the horizon.

    It is the rate of the legs' angular momentum, −Ḣ/(m (g + z̈)), and the controller shifts its ZMP box by it:

        offset(k) = table(phase of k) + lever · (acceleration of the swing foot at k)

    The second term follows from the plan. The rest repeats every step, mirrored in y, and is learned: the discrete
    state is a table (2 axes, N ticks) for steps on the left foot.

    Input ports:
        gait_phase (3), whole_body_zmp (2), zmp_reference (4), foot_reference (18), foot_plan (8), stance_plan (8): as
            in `systems.signals`; the last three are needed with a lever only.
        those of `ChangedGait`.
    Output ports:
        zmp_offset (2 H): expected whole-body minus template ZMP at the next H ticks, x then y [m].

    Args:
        gait: the walk. horizon: H [ticks].
        lever: see `robot.swing_lever` (2,) [s²]; without it the whole offset is learned.

    Attributes:
        tables: how many tables the state consists of.
    """

    tables = 1

    def __init__(self, gait: Gait, horizon: int, lever: np.ndarray | None = None) -> None:
        super().__init__()
        self._walk, self._period, self._horizon = gait, gait.period, horizon
        self._swing = Swing(gait)
        x, y = (0.0, 0.0) if lever is None else np.asarray(lever, dtype=float).tolist()
        self._lever = (x, y)
        height = gait.config.com_height
        self._most, self._most_of_swing = _LARGEST * height, _LARGEST_SWING * height
        self._has_lever = any(self._lever)
        self._sides = lru_cache(maxsize=4)(self._sides_from)
        ports = [self.DeclareVectorInputPort(name, size(name)) for name in _INPUTS]
        self._phase, self._whole_body_zmp, self._planned_zmp = ports[:3]
        self._motion = ports[3:]
        self._foot_reference = ports[3]
        self._gait = ChangedGait(self, gait)
        self.DeclareDiscreteState(2 * self._period * self.tables)
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._update)
        prerequisites = {self.xd_ticket(), self._phase.ticket(), *(port.ticket() for port in ports[3:])}
        prerequisites |= self._gait.tickets
        self.DeclareVectorOutputPort(
            "zmp_offset", size("zmp_offset", horizon=horizon), weakly(self._calc), prerequisites
        )

    def _update(self, context: Context, values: DiscreteValues) -> None:
        feet = self._foot_reference.Eval(context) if self._has_lever else None
        zmp, planned = self._whole_body_zmp.Eval(context), self._planned_zmp.Eval(context)
        table = context.get_discrete_state_vector().value()
        gait = self._gait(context) if self.tables > 1 else self._walk
        values.set_value(self.learned(self._phase.Eval(context), zmp, planned, feet, table, gait))

    def learned(
        self, gait_phase: np.ndarray, zmp: np.ndarray, planned: np.ndarray, feet: np.ndarray | None, table: np.ndarray,
        gait: Gait,
    ) -> np.ndarray:  # fmt: skip
        """The table after a tick, from whole_body_zmp, zmp_reference, foot_reference (with a lever), and the table.

        Where there is more than one, the gait is the one that has been changed.
        """
        tick, _, support = gait_phase.tolist()
        table = table.copy()
        if support:
            moved = AT_REST if feet is None else feet
            update_table(round(tick), support, zmp, planned, moved, self._lever, self._most, table)
        return table

    def _calc(self, context: Context, output: BasicVector) -> None:
        feet, plan, stances = (port.Eval(context) if self._has_lever else None for port in self._motion)
        table = context.get_discrete_state_vector().value()
        expected = self.expected(self._phase.Eval(context), feet, plan, stances, table, self._gait(context))
        output.SetFromVector(expected.ravel())

    def expected(
        self, gait_phase: np.ndarray, feet: np.ndarray | None, plan: np.ndarray | None, stances: np.ndarray | None,
        table: np.ndarray, gait: Gait,
    ) -> np.ndarray:  # fmt: skip
        """zmp_offset (2, H) from foot_reference, foot_plan and stance_plan (each with a lever), and the table."""
        tick, step, _ = gait_phase.tolist()
        here = slice(round(tick) + 1, round(tick) + 1 + self._horizon)
        side, expected = self._sides(round(step), gait)[here], np.empty((2, self._horizon))
        write_table_offset(round(tick), side, table, expected)
        if feet is not None and plan is not None and stances is not None:
            reference, plan, after = feet.reshape(2, 3, 3), plan.reshape(2, 2, 2), stances[STANCE_AFTER]
            most = self._most_of_swing
            profiles = gait.profiles(round(step)) if gait.uneven else ()
            self._swing.add_accelerations(
                round(tick), side, reference, plan, after, self._lever, most, expected, profiles
            )
        return expected

    def _sides_from(self, step: int, gait: Gait) -> np.ndarray:
        """The stance foot at each tick from the start of a step on: +1 left, −1 right, 0 both."""
        seen = gait.seen(step)
        steps = range(step, step + self._horizon // self._period + 2)
        return np.repeat([float(seen[index].side) for index in steps], self._period)
