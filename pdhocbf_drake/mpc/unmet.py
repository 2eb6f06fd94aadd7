"""Which named constraints of a program without a solution are missed, and by how much."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier, affine_rows
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.mpc.solution import CONSTRAINTS, NOTICED, Reason
from pdhocbf_drake.qp import ParametricQp
from pdhocbf_drake.walking.vhip import Vhip

_ROWS = {
    "stability": ("stability", "terminal set"),
    "zmp_box": ("zmp_box_lower", "zmp_box_upper"),
    "step": ("step_lower", "step_upper"),
}


def unmet(
    plan: Plan, qps: Sequence[ParametricQp], thetas: Sequence[np.ndarray], reasons: Sequence[Reason]
) -> np.ndarray:
    """What to tell as `Plan.unmet`, shape (2, 3) [m].

    Args:
        plan: what is done instead; what it tells already of another program is kept.
        qps: the programs of both axes as the scenario asks for them.
        thetas: their parameters.
        reasons: what became of each.
    """
    told = plan.unmet.copy()
    for axis, why in enumerate(reasons):
        if why in (Reason.RELAXED, Reason.NO_STEADY_PLAN):
            decisions = np.concatenate([plan.inputs[axis], plan.footholds[axis]])
        elif why == Reason.INFEASIBLE:
            decisions = None
        else:
            continue
        told[axis] = np.maximum(told[axis], missed(qps[axis], thetas[axis], decisions))
    return told


def missed(qp: ParametricQp, theta: np.ndarray, decisions: np.ndarray | None) -> np.ndarray:
    """By how much each of `CONSTRAINTS` is missed at θ, shape (3,) [m]; what is not noticed is 0.

    Args:
        qp: the program of one axis and phase.
        theta: its parameters.
        decisions: the first of its decisions, the slacks left out; None for no plan at all: then a constraint is
            missed by as much as its own bounds contradict each other.
    """
    _, low, high = qp.vectors(theta)
    if decisions is None:
        beyond = low - high
    else:
        value = qp.A[:, : len(decisions)] @ decisions
        beyond = np.maximum(low - value, value - high)
    names = np.array(qp.names)
    amounts = np.array([beyond[np.isin(names, _ROWS[name])].max(initial=0.0) for name in CONSTRAINTS])
    return np.where(amounts > NOTICED, amounts, 0.0)


def slack_starts(barriers: Sequence[AffineBarrier], vhip: Vhip, horizon: int) -> np.ndarray:
    """Where the slacks of each barrier begin among all slacks of a soft program, see `AxisProgram`."""
    counts = [int(affine_rows(barrier, vhip.system, 0, horizon).reachable.sum()) for barrier in barriers[:-1]]
    return np.cumsum([0, *counts])[: len(barriers)]


def slack_by_barrier(slacks: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """The largest slack of each barrier [m/s]; a hard program has no slacks, so 0."""
    return np.maximum.reduceat(slacks, starts) if len(slacks) and slacks.any() else np.zeros(len(starts))
