"""Limits of each coming step: how far a foothold may lie from the one before it."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import ClassVar

import numpy as np

from pdhocbf_drake.mpc.commanded import Commanded
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import RowKind, Term, Tick
from pdhocbf_drake.walking.frame import inner_share, rotation
from pdhocbf_drake.walking.sides import BOTH

_REACH_OF_TOES = 0.1  # [m]: of half a sole, by which a turned foot comes closer to the other one


class StepLimits(Term):
    """lower_j ≤ f_j − f_{j−1} ≤ upper_j for each coming step.

    A step lies within `mpc.step_tolerance` of the commanded one, or within `mpc.step_reach` of the stance foot, and
    the new stance foot stays on its own side of the old one, at least `mpc.stance_width_min` away. The next step is
    held where it is planned from `mpc.freeze_ticks` before its touchdown on; before that, `mpc.swing_acceleration`
    limits how far it may still be moved.

    Parameters: step_lower, step_upper (n_f,) each [m].
    """

    rows: ClassVar = {
        "step_lower": RowKind("step", is_bound=True, missed_as="step"),
        "step_upper": RowKind("step", is_bound=True, missed_as="step"),
    }
    axes_alike = True

    @property
    def sizes(self) -> dict[str, int]:
        return dict.fromkeys(self.rows, self.setting.config.horizon // self.setting.gait.period)

    def write(self, program: AxisProgram) -> None:
        count = len(program.f)
        moves = np.eye(count, count + 2, 2) - np.eye(count, count + 2, 1)
        for name, sign in zip(self.rows, (1.0, -1.0), strict=True):
            variables = np.concatenate([program.feet, program.part[name]])
            program.at_least(sign * np.hstack([moves, -np.eye(count)]), variables, name)

    def fill_step(self, step: int, ahead: Commanded, theta: np.ndarray) -> None:
        lower, upper = step_ranges(self.setting.config, ahead)
        theta[self.places["step_lower"]] = lower[self.axis]
        theta[self.places["step_upper"]] = upper[self.axis]

    def fill_tick(self, tick: Tick, theta: np.ndarray) -> None:
        config, gait = self.setting.config, self.setting.gait
        if tick.last is None or tick.last.tick // gait.period != tick.step:
            return
        low, high = self.places["step_lower"].start, self.places["step_upper"].start
        left = gait.period - tick.phase - config.freeze_ticks
        if left <= 0:
            theta[low] = theta[high] = tick.last.footholds[self.axis, 0] - tick.stance[self.axis, 1]
        elif config.swing_acceleration is not None and tick.phase > gait.config.double_support_ticks:
            planned = tick.last.footholds[self.axis, 0] - tick.stance[self.axis, 1]
            room = config.swing_acceleration / 10.0 * (left * gait.config.tick) ** 2
            theta[low] = min(max(theta[low], planned - room), theta[high])
            theta[high] = max(min(theta[high], planned + room), theta[low])


def step_ranges(config: MpcConfig, ahead: Commanded) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest move to each coming foothold as the walk is commanded, shapes (2, n_f) [m].

    The limits of a step hold along the axes of the foot that it is made from. Where these are turned, what a foothold
    may deviate from the commanded one is the largest similar rectangle inside.
    """
    lower, upper = ahead.moves.copy(), ahead.moves.copy()
    for i, (before, after) in enumerate(pairwise(ahead.steps)):
        if BOTH in (before.side, after.side):
            continue  # a stand begins or ends where the feet are
        turn = before.yaw - ahead.yaw
        move = rotation(-turn) @ ahead.moves[:, i] if turn else ahead.moves[:, i]
        low, high = _range(config, move, after.side, after.yaw - before.yaw)
        if turn:
            share = inner_share(low - move, high - move, -turn)
            low, high = (ahead.moves[:, i] + share * (limit - move) for limit in (low, high))
        lower[:, i], upper[:, i] = low, high
    return lower, upper


def _range(config: MpcConfig, move: np.ndarray, side: int, turn: float) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest move of one step along the axes of the foot that it is made from, shapes (2,) [m].

    Args:
        move: as commanded (2,) [m].
        side: of the coming stance foot.
        turn: its heading from that of this foot [rad].
    """
    if config.step_reach is None:
        low, high = move - config.step_tolerance, move + config.step_tolerance
    else:
        low, high = np.negative(config.step_reach), np.array(config.step_reach)
    least = config.stance_width_min
    if turn:  # the toe or heel of a turned foot is nearer, and what a turn commands is allowed
        least = min(least + _REACH_OF_TOES * abs(math.sin(turn)), side * float(move[1]))
    if side > 0:
        low[1] = max(low[1], least)
    else:
        high[1] = min(high[1], -least)
    return low, high
