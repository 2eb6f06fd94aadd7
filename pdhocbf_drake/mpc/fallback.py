"""What is planned where no program has a solution: the last plan, shifted by a tick."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdhocbf_drake.mpc.plan import Plan, Reason
from pdhocbf_drake.mpc.walk_problem import WalkProblem


def shifted(
    problem: WalkProblem,
    tick: int,
    state: np.ndarray,
    stance: np.ndarray,
    last: Plan | None,
    reason: Reason,
    rows: Sequence[int],
) -> Plan:
    """The last plan shifted by a tick, its first input repeated at the end as in (32), its next ZMP in the box.

    Args:
        problem: of the walk.
        tick, state, stance, last: as in `PeriodicMpc.solve`, in the axes of the stance foot.
        reason: why there is no solution.
        rows: flags of active constraints per axis, where there is no last plan.
    """
    step = tick // problem.gait.period
    ahead = problem.commanded.steps(step)
    targets = stance[:, 1:] + np.cumsum(ahead.moves, axis=1)
    if last is None:
        inputs, footholds, count = np.zeros((2, problem.config.horizon)), targets, 1
        active = (np.zeros(rows[0]), np.zeros(rows[1]))
    else:
        inputs, count, active = np.roll(last.inputs, -1, axis=1), last.fallbacks + 1, last.active
        footholds = last.footholds
        if step != last.tick // problem.gait.period:
            footholds = np.hstack([footholds[:, 1:], footholds[:, -1:] + ahead.moves[:, -1:]])
    low, high = problem.box(tick + 1, stance, footholds).T
    delta = problem.gait.config.tick
    inputs[:, 0] = (np.clip(state[:, 2] + delta * inputs[:, 0], low, high) - state[:, 2]) / delta
    slacks = np.zeros(sum(map(len, problem.barriers)))
    return Plan(tick, inputs, footholds, active, slacks, np.nan, reason, count, unmet=problem.all_met, acting=slacks)
