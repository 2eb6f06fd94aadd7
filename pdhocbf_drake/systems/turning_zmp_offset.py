"""The ZMP offset of a walk that turns, learned along the axes of the stance foot."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.systems.kernels import update_table, write_table_offset
from pdhocbf_drake.systems.zmp_offset import STANCE_AFTER, ZmpOffset
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.frame import rotation

_X_AND_Y = [0, 2]  # of zmp_reference


class TurningZmpOffset(ZmpOffset):
    """`ZmpOffset` with a table for each foot, as the inner and the outer step of a turn differ.

    What the tables hold is seen along the axes of the stance foot. The offsets of coming steps are turned with them,
    and all leave the block along the world's axes.
    """

    tables = 2

    def _update(self, context: Context, values: DiscreteValues) -> None:
        tick, step, support = self._phase.Eval(context).tolist()
        tables = context.get_discrete_state_vector().value().copy()
        if support:
            seen = rotation(-self._gait(context).step(round(step)).yaw)
            feet = self._foot_reference.Eval(context).reshape(2, 3, 3).copy()
            feet[..., :2] = feet[..., :2] @ seen.T
            planned = np.zeros(4)
            planned[_X_AND_Y] = seen @ self._planned_zmp.Eval(context)[_X_AND_Y]
            zmp, table = seen @ self._whole_body_zmp.Eval(context), tables.reshape(2, -1)[0 if support > 0.0 else 1]
            update_table(round(tick), support, zmp, planned, feet.ravel(), self._lever, self._most, table)
        values.set_value(tables)

    def _calc(self, context: Context, output: BasicVector) -> None:
        tick, step, _ = self._phase.Eval(context).tolist()
        gait = self._gait(context)
        here = slice(round(tick) + 1, round(tick) + 1 + self._horizon)
        side, yaws = self._sides(round(step), gait)[here], self._yaws(round(step), gait)
        left, right = context.get_discrete_state_vector().value().reshape(2, -1)
        expected, other = np.empty((2, self._horizon)), np.empty((2, self._horizon))
        write_table_offset(round(tick), side, left, expected)
        write_table_offset(round(tick), side, right, other)
        expected[:, side < 0.0] = other[:, side < 0.0]
        self._turn_coming(expected, yaws, round(tick))
        yaw = yaws[0]
        seen, back = rotation(-yaw), rotation(yaw)
        reference = self._foot_reference.Eval(context).reshape(2, 3, 3).copy()
        reference[..., :2] = reference[..., :2] @ seen.T
        plan = self._foot_plan.Eval(context).reshape(2, 2, 2) @ seen.T
        after = seen @ self._stance_plan.Eval(context)[STANCE_AFTER]
        most = self._most_of_swing
        self._swing.add_accelerations(round(tick), side, reference, plan, after, self._lever, most, expected)
        output.SetFromVector((back @ expected).ravel())

    def _turn_coming(self, expected: np.ndarray, yaws: list[float], tick: int) -> None:
        """Turns the offsets of the ticks in coming steps to the axes of this one."""
        for i, yaw in enumerate(yaws[1:], start=1):
            first = i * self._period - tick - 1
            part = slice(max(first, 0), first + self._period)
            if yaw != yaws[0] and part.start < self._horizon:
                expected[:, part] = rotation(yaw - yaws[0]) @ expected[:, part]

    def _yaws(self, step: int, gait: Gait) -> list[float]:
        """The heading of the stance foot in this and the coming steps [rad]."""
        seen = gait.seen(step)
        return [seen[step + i].yaw for i in range(self._horizon // self._period + 1)]
