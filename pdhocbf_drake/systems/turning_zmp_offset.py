"""The ZMP offset of a walk that turns, learned along the axes of the stance foot."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.systems.kernels import update_table, write_table_offset
from pdhocbf_drake.systems.zmp_offset import AT_REST, STANCE_AFTER, ZmpOffset
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.frame import rotation

_X_AND_Y = [0, 2]  # of zmp_reference


class TurningZmpOffset(ZmpOffset):
    """`ZmpOffset` with a table for each foot, as the inner and the outer step of a turn differ.

    What the tables hold is seen along the axes of the stance foot. The offsets of coming steps are turned with them,
    and all leave the block along the world's axes.
    """

    tables = 2

    def learned(
        self, gait_phase: np.ndarray, zmp: np.ndarray, planned: np.ndarray, feet: np.ndarray | None, table: np.ndarray,
        gait: Gait,
    ) -> np.ndarray:  # fmt: skip
        """The tables after a tick."""
        tick, step, support = gait_phase.tolist()
        tables = table.copy()
        if support:
            seen = rotation(-gait.step(round(step)).yaw)
            moved = (AT_REST if feet is None else feet).reshape(2, 3, 3).copy()
            moved[..., :2] = moved[..., :2] @ seen.T
            along = np.zeros(4)
            along[_X_AND_Y] = seen @ planned[_X_AND_Y]
            own = tables.reshape(2, -1)[0 if support > 0.0 else 1]
            update_table(round(tick), support, seen @ zmp, along, moved.ravel(), self._lever, self._most, own)
        return tables

    def expected(
        self, gait_phase: np.ndarray, feet: np.ndarray | None, plan: np.ndarray | None, stances: np.ndarray | None,
        table: np.ndarray, gait: Gait,
    ) -> np.ndarray:  # fmt: skip
        """zmp_offset (2, H)."""
        tick, step, _ = gait_phase.tolist()
        here = slice(round(tick) + 1, round(tick) + 1 + self._horizon)
        side, yaws = self._sides(round(step), gait)[here], self._yaws(round(step), gait)
        left, right = table.reshape(2, -1)
        expected, other = np.empty((2, self._horizon)), np.empty((2, self._horizon))
        write_table_offset(round(tick), side, left, expected)
        write_table_offset(round(tick), side, right, other)
        expected[:, side < 0.0] = other[:, side < 0.0]
        self._turn_coming(expected, yaws, round(tick))
        yaw = yaws[0]
        seen, back = rotation(-yaw), rotation(yaw)
        if feet is not None and plan is not None and stances is not None:
            reference = feet.reshape(2, 3, 3).copy()
            reference[..., :2] = reference[..., :2] @ seen.T
            turned, after = plan.reshape(2, 2, 2) @ seen.T, seen @ stances[STANCE_AFTER]
            most = self._most_of_swing
            profiles = gait.profiles(round(step)) if gait.uneven else ()
            self._swing.add_accelerations(
                round(tick), side, reference, turned, after, self._lever, most, expected, profiles
            )
        return np.asarray(back @ expected)

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
