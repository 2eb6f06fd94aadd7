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
from pdhocbf_drake.walking.frame import inner_box, rotation
from pdhocbf_drake.walking.sides import BOTH
from pdhocbf_drake.walking.walker import GAP

_LEAST_GAP = 0.012  # between the soles of a disturbed walk that turns, which comes 2 mm closer [m]
_ARRIVING = 4  # ticks before the swing foot comes to its place, at which that is held
_FARTHEST_ASIDE = 0.25  # that a foot has to land for the other one to pass it [m]


class StepLimits(Term):
    """lower_j ≤ f_j − f_{j−1} ≤ upper_j for each coming step.

    A step lies within `mpc.step_tolerance` of the commanded one, or within `mpc.step_reach` of the stance foot, and
    the new stance foot stays on its own side of the old one, at least `mpc.stance_width_min` away, and in a walk that
    follows commands so far that the soles stay apart. Within `step_reach` a foot may land anywhere for that, and so
    lands as far aside as it needs to anywhere, and as the other foot needs to pass it then; beyond
    `mpc.limits.step_reach` it lands nowhere. The next step is held where it is planned from `mpc.freeze_ticks` before
    its touchdown on, or from where the swing foot has come to it; before that, `mpc.swing_acceleration` limits how far
    it may still be moved. On uneven ground each foot lands in the window of its footstep, as far as legs reach it.

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
        axis, last, config, gait = self.axis, tick.last, self.setting.config, self.setting.gait
        if axis == 0 and tick.ahead.windows is not None:
            self._keep_in_windows(tick, tick.ahead.windows, theta)
        if last is None or last.tick // gait.period != tick.step:
            return
        low, high = self.places["step_lower"].start, self.places["step_upper"].start
        if axis == 1 and config.step_reach is not None:
            least = _to_pass(tick.ahead, float(last.footholds[0, 0] - tick.stance[0, 1]))
            if tick.ahead.steps[1].side > 0:
                theta[low] = max(theta[low], least)
            else:
                theta[high] = min(theta[high], -least)
        arriving = tick.ahead.early + _ARRIVING if tick.ahead.early else 0
        left = gait.period - tick.phase - max(config.freeze_ticks, arriving)
        if left <= 0:
            theta[low] = theta[high] = last.footholds[axis, 0] - tick.stance[axis, 1]
        elif config.swing_acceleration is not None and tick.phase > gait.config.double_support_ticks:
            planned = last.footholds[axis, 0] - tick.stance[axis, 1]
            room = config.swing_acceleration / 10.0 * (left * gait.config.tick) ** 2
            theta[low] = min(max(theta[low], planned - room), theta[high])
            theta[high] = max(min(theta[high], planned + room), theta[low])

    def _keep_in_windows(self, tick: Tick, windows: np.ndarray, theta: np.ndarray) -> None:
        """Moves to each coming foothold that end in its window, from the present stance and then as commanded."""
        lower, upper = (theta[self.places[name]] for name in self.rows)
        commanded = tick.ahead.centre[0] + np.cumsum(tick.ahead.moves[0])
        before = np.concatenate([[tick.here[0]], commanded[:-1]])
        low, high = (np.clip(side - before, lower, upper) for side in windows.T)
        lower[:], upper[:] = low, high


def step_ranges(config: MpcConfig, ahead: Commanded) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest move to each coming foothold as the walk is commanded, shapes (2, n_f) [m].

    The limits of a step hold along the axes of the foot that it is made from. Where these are turned, what a foothold
    may deviate from the commanded one, or from the allowed one next to it, is a rectangle inside, see `inner_box`.
    """
    lower, upper = ahead.moves.copy(), ahead.moves.copy()
    for i, (before, after) in enumerate(pairwise(ahead.steps)):
        if BOTH in (before.side, after.side):
            continue  # a stand begins or ends where the feet are
        turn = before.yaw - ahead.yaw
        move = rotation(-turn) @ ahead.moves[:, i] if turn else ahead.moves[:, i]
        low, high = _range(config, move, after.side, after.yaw - before.yaw, ahead.sole)
        if turn:
            allowed = np.clip(move, low, high)
            centre, (low, high) = rotation(turn) @ allowed, inner_box(low - allowed, high - allowed, -turn)
            low, high = centre + low, centre + high
        lower[:, i], upper[:, i] = low, high
    return lower, upper


def _range(
    config: MpcConfig, move: np.ndarray, side: int, turn: float, sole: tuple[float, float] | None
) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest move of one step along the axes of the foot that it is made from, shapes (2,) [m].

    Args:
        move: as commanded (2,) [m].
        side: of the coming stance foot.
        turn: its heading from that of this foot [rad].
        sole: half length and half width of the soles, which stay apart; None where there are none [m].
    """
    if config.step_reach is None:
        low, high = move - config.step_tolerance, move + config.step_tolerance
    else:
        low, high = np.negative(config.step_reach), np.array(config.step_reach)
    if (limits := config.plan_limits) is not None:
        low, high = np.maximum(low, np.negative(limits.step_reach)), np.minimum(high, limits.step_reach)
    least, aside = config.stance_width_min, side * float(move[1])
    if sole is not None and config.step_reach is not None and turn:  # anywhere, if need be wider than commanded
        least = max(least, _apart(turn, sole) + _LEAST_GAP)
    else:
        if sole is not None:
            least = max(least, _keep_apart(low, high, float(move[0]), aside, side * turn, sole))
        if turn:
            least = min(least, aside)  # what a turn commands is allowed
    if side > 0:
        low[1] = max(low[1], least)
    else:
        high[1] = min(high[1], -least)
    return low, high


def _keep_apart(
    low: np.ndarray, high: np.ndarray, ahead: float, aside: float, outward: float, sole: tuple[float, float]
) -> float:
    """How far aside a foot has to land for the soles to be `GAP` apart [m]; reduces the range of x where it must.

    Of two rectangles with half sides a, b, one turned by θ, the edges along the length of one of them separate them by
    y − r or by y cos θ − x sin θ − r, with r = b (1 + cos θ) + a |sin θ|: x ahead, y to the foot's own side, θ > 0 with
    the toes outward. The first holds for any x. Where the commanded foothold needs the second one, no foothold is
    closer aside than that, and x keeps to where it holds.

    Args:
        low, high: the ranges of the move, shapes (2,) [m].
        ahead, aside: the commanded move, the latter to the foot's own side [m].
        outward: θ [rad].
        sole: a and b [m].
    """
    c, s = math.cos(outward), math.sin(outward)
    needed = _apart(outward, sole) + GAP
    if needed <= aside or not s:
        return needed
    farthest = (aside * c - needed) / s  # x at which the second one is `GAP`
    if s > 0.0:
        high[0] = min(high[0], max(farthest, ahead))
    else:
        low[0] = max(low[0], min(farthest, ahead))
    return needed


def _to_pass(ahead: Commanded, x: float) -> float:
    """How far aside the next foot of a disturbed walk has to land, x ahead, for the other one to pass it then [m].

    Seen from the landed foot, with θ as in `_keep_apart`, the other one is y cos θ − x sin θ aside: after a long step
    that turns, it would swing through the stance foot. Minus infinity where feet don't turn.
    """
    this, coming = ahead.steps[:2]
    outward = coming.side * (coming.yaw - this.yaw)
    if ahead.sole is None or not outward or BOTH in (this.side, coming.side):
        return -math.inf
    needed = _apart(outward, ahead.sole) + _LEAST_GAP
    return min((needed + x * math.sin(outward)) / math.cos(outward), _FARTHEST_ASIDE)


def _apart(turn: float, sole: tuple[float, float]) -> float:
    """r of `_keep_apart`: how far aside a foot touches the other one, wherever it is ahead [m]."""
    return sole[1] * (1.0 + math.cos(turn)) + sole[0] * abs(math.sin(turn))
