"""Limits of each coming step: how far a foothold may lie from the one before it."""

from __future__ import annotations

from itertools import pairwise
from typing import ClassVar

import numpy as np

from pdhocbf_drake.mpc.commanded import Commanded
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import RowKind, Term, Tick
from pdhocbf_drake.walking.footsteps import BOTH


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
    """Least and greatest move to each coming foothold as the walk is commanded, shapes (2, n_f) [m]."""
    lower, upper = ahead.moves.copy(), ahead.moves.copy()
    for i, (before, after) in enumerate(pairwise(ahead.steps)):
        if BOTH in (before.side, after.side):
            continue  # a stand begins or ends where the feet are
        if config.step_reach is None:
            lower[:, i] -= config.step_tolerance
            upper[:, i] += config.step_tolerance
        else:
            lower[:, i], upper[:, i] = np.negative(config.step_reach), config.step_reach
        if after.side > 0:
            lower[1, i] = max(lower[1, i], config.stance_width_min)
        else:
            upper[1, i] = min(upper[1, i], -config.stance_width_min)
    return lower, upper
