"""The periodic MPC on its own template from given starts: does it ever find no plan?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan, Reason
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.studies.certify.starts import Start

# A soft barrier's slack is part of the plan; a hard one that had to be softened left none.
_PLANNED = {
    "soft": (Reason.SOLVED, Reason.SOFTENED, Reason.CROSS_SOLVED),
    "hard": (Reason.SOLVED, Reason.CROSS_SOLVED),
}
_SIDES = {1: 0, -1: 1}  # rows of Memory.feet


class Walked(NamedTuple):
    """One closed loop.

    Attributes:
        infeasible_ticks: ticks for which no plan met the scenario's own constraints.
        ticks: ticks walked.
        h_min: least h of any barrier; inf without barriers [m/s].
        slack: largest slack of any barrier row [m/s].
    """

    infeasible_ticks: int
    ticks: int
    h_min: float
    slack: float


def walk_from(mpc: PeriodicMpc, starts: Sequence[Start], zmps: Sequence[float], ticks: int) -> Walked:
    """Walks the template under the MPC, without disturbances.

    Args:
        mpc: the controller.
        starts: for x and y, at the same phase of a gait; c and s as the stepping template has them.
        zmps: the ZMP now from the stance foot, for x and y [m].
        ticks: how long.
    """
    tick, memory = _start(mpc, starts, zmps)
    infeasible, h_min, slack = 0, np.inf, 0.0
    for k in range(tick, tick + ticks):
        bounds = {b.name: b.bound.samples(k, mpc.config.horizon + 1) for group in mpc.barriers for b in group}
        for axis, group in enumerate(mpc.barriers):
            h_min = min(h_min, *(float(b.h(k, memory.state[axis])) for b in group)) if group else h_min
        plan = mpc.solve(k, memory.state, memory.stance, bounds, None, memory.plan)
        infeasible += plan.reason not in _PLANNED[mpc.config.barrier]
        slack = max(slack, plan.slack)
        memory.advance(mpc, memory.state, plan)
        if not np.all(np.abs(memory.state - memory.stance[:, 1:] * [1.0, 0.0, 1.0]) < 1e2):
            infeasible += tick + ticks - k - 1  # fallen: nothing that follows is a walk
            break
    return Walked(infeasible, ticks, h_min, slack)


def _start(mpc: PeriodicMpc, starts: Sequence[Start], zmps: Sequence[float]) -> tuple[int, Memory]:
    """The controller's memory in the middle of a walk, at an even step or the one after it."""
    gait, n = mpc.gait, mpc.gait.period
    first = gait.config.start_steps + 2 + gait.config.start_steps % 2
    tick = first * n + max(start.phase for start in starts)
    step, phase = gait.phase(tick)
    here = mpc.commanded.steps(step).centre
    commanded = mpc.commanded.steps(step - 1).moves[:, 0]
    coming = n - phase <= mpc.config.freeze_ticks
    chosen = np.array([start.state[2] if len(start.state) == 3 else np.nan for start in starts])
    last = np.where(coming | np.isnan(chosen), commanded, chosen)
    stance = np.stack([here - last, here], axis=1)
    feet = np.empty((2, 2))
    feet[_SIDES[gait.support(step)]], feet[_SIDES[-gait.support(step)]] = stance[:, 1], stance[:, 0]
    state: Array = np.array([
        [start.state[0] + foot, start.state[1], zmp + foot] for start, zmp, foot in zip(starts, zmps, here, strict=True)
    ])  # fmt: skip
    memory = Memory.at_start(mpc, state, feet)
    memory.stance = stance
    if coming:
        moves = mpc.commanded.steps(step).moves.copy()
        moves[:, 0] = np.where(np.isnan(chosen), moves[:, 0], chosen)
        footholds = here[:, None] + np.cumsum(moves, axis=1)
        nothing = (np.zeros(mpc.rows[0]), np.zeros(mpc.rows[1]))
        inputs = np.zeros((2, mpc.config.horizon))
        memory.plan = Plan(tick - 1, inputs, footholds, nothing, np.zeros(0), np.nan, Reason.SOLVED, 0)
    return tick, memory
