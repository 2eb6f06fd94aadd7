"""The accuracy of answers, against the optimum to rounding, and how often the solver gives none.

The reference is the KKT system of a program's active set, solved directly and checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.qp import ParametricQp
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.studies.bench.recording import AXES, Tick, theta
from pdhocbf_drake.studies.bench.routes import Route, Updated

TOLERANCE = 1e-12
"""Primal violation, and wrong sign of a multiplier relative to the largest one, that a reference may have."""
_NEAR = 1e-6  # rows of the start that are this near to a bound are active at first
_ROUNDS = 60


class Gap(NamedTuple):
    """The distance of an answer from the optimum.

    Attributes:
        relative: (cost − optimal cost)/|optimal cost|.
        violation: of the worst row, in the row's unit.
        certain: whether the reference met its own tolerance.
    """

    relative: float
    violation: float
    certain: bool


def gap(qp: ParametricQp, theta: np.ndarray, decisions: np.ndarray, start: np.ndarray) -> Gap:
    """The gap of `decisions` to the reference, found from another solver's answer `start`."""
    exact, certain = reference(qp, theta, start)
    f, low, high = qp.vectors(theta)

    def cost(w: np.ndarray) -> float:
        return float(0.5 * w @ qp.P @ w + f @ w + qp.constant(theta))

    optimum = cost(exact)
    rows = qp.A @ decisions
    violation = max(float((low - rows).max()), float((rows - high).max()), 0.0)
    return Gap((cost(decisions) - optimum) / abs(optimum), violation, certain)


def reference(qp: ParametricQp, theta: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, bool]:
    """The optimum, and whether its KKT conditions hold to `TOLERANCE`.

    From the rows active at `start`: solve for the point where they hold with equality, drop the one whose multiplier
    has the worst sign, else add the row violated most, until neither is left.
    """
    f, low, high = qp.vectors(theta)
    equal = low == high
    rows = qp.A @ start
    side = np.where(rows > high - _NEAR, 1, 0) - np.where(rows < low + _NEAR, 1, 0)
    side[equal] = 1
    point = start
    for _ in range(_ROUNDS):
        active = np.flatnonzero(side)
        point, multipliers = _stationary(qp, f, active, np.where(side > 0, high, low)[active])
        wrong = np.where(equal[active], 0.0, -multipliers * side[active])
        scale = max(float(np.abs(multipliers).max(initial=0.0)), 1.0)
        rows = qp.A @ point
        beyond = np.maximum(low - rows, rows - high)
        if len(wrong) and wrong.max() > TOLERANCE * scale:
            side[active[wrong > TOLERANCE * scale]] = 0
        elif beyond.max() > TOLERANCE:
            worst = int(beyond.argmax())
            side[worst] = 1 if rows[worst] > high[worst] else -1
        else:
            return point, True
    return point, False


def _stationary(
    qp: ParametricQp, f: np.ndarray, active: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """min ½ wᵀPw + fᵀw with the active rows at their values: w and the multipliers, refined once.

    Rows may depend on each other, so the multipliers come from a least-squares solution.
    """
    A = qp.A[active]
    scale = 1.0 / np.sqrt(np.diag(qp.P))
    P = qp.P * np.outer(scale, scale)
    inverse = np.linalg.inv(P)
    B = A * scale
    size = np.linalg.norm(B, axis=1)
    B = B / size[:, None]
    x, y = np.zeros(len(f)), np.zeros(len(active))
    for _ in range(3):
        dual_rest = -(f * scale) - P @ x - B.T @ y
        primal_rest = values / size - B @ x
        schur = B @ inverse @ B.T
        dy = np.linalg.lstsq(schur, B @ inverse @ dual_rest - primal_rest, rcond=1e-14)[0]
        y += dy
        x += inverse @ (dual_rest - B.T @ dy)
    return x * scale, y / size


def gaps(walk: Walk, ticks: Sequence[Tick], others: Sequence[Route]) -> dict[str, list[Gap]]:
    """The gap of ours and of every other route at each tick and axis, to one reference."""
    mpc, first = walk.mpc, next(route for route in others if isinstance(route, Updated))
    found: dict[str, list[Gap]] = {name: [] for name in ("ours", *(route.name for route in others))}
    for given in ticks:
        phase = given.tick % walk.gait.period
        answers = {route.name: route.decide(given) for route in others}
        for axis in AXES:
            qp, parameters = mpc.qps[axis][phase], theta(mpc, given, axis)
            decisions = {name: answer[axis][: len(qp.P)] for name, answer in answers.items()}
            start = decisions[first.name]
            decisions["ours"] = mpc.solvers[axis][phase].solve(parameters, given.guess(axis)).decisions
            for name, w in decisions.items():
                found[name].append(gap(qp, parameters, w, start))
    return found


def worst(found: Sequence[Gap]) -> tuple[float, float, int]:
    """Largest relative gap, largest violation, and how many references met their own tolerance."""
    certain = [each for each in found if each.certain]
    relative = max((abs(each.relative) for each in certain), default=float("nan"))
    return relative, max(each.violation for each in found), len(certain)


def exits(reasons: np.ndarray) -> dict[str, int]:
    """Number of ticks by reason, for each reason other than a solution of the first solver."""
    return {reason.name: int(np.sum(reasons == reason)) for reason in Reason if reason > Reason.SOFTENED}
