"""How exact our answers are, and how often the solver gives none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.qp import QpSolver, make_solver
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.studies.bench.recording import Tick, theta
from pdhocbf_drake.studies.bench.reference import Gap, gap
from pdhocbf_drake.studies.bench.routes import AXES, Route, Updated


def gaps(walk: Walk, ticks: Sequence[Tick], others: Sequence[Route]) -> dict[str, list[Gap]]:
    """The gap of ours and of every other route at each tick and axis, to one reference."""
    mpc = walk.mpc
    solvers: dict[tuple[int, int], QpSolver] = {}
    first = next(route for route in others if isinstance(route, Updated))
    found: dict[str, list[Gap]] = {name: [] for name in ("ours", *(route.name for route in others))}
    for given in ticks:
        phase = given.tick % walk.gait.period
        answers = {route.name: route.decide(given) for route in others}
        for axis in AXES:
            qp, parameters = mpc.qps[axis][phase], theta(mpc, given, axis)
            if (axis, phase) not in solvers:
                problem = mpc.problems[axis]
                rows = problem.guess_rows(mpc.qps[axis], phase)
                solvers[axis, phase] = make_solver(mpc.config.solver, qp, problem.bound_rows, rows)
            guess = None if given.last is None else given.last.active[axis]
            ours = solvers[axis, phase].solve(parameters, guess).decisions
            start = answers[first.name][axis][: len(qp.P)]
            found["ours"].append(gap(qp, parameters, ours, start))
            for name, answer in answers.items():
                found[name].append(gap(qp, parameters, answer[axis][: len(qp.P)], start))
    return found


def worst(found: Sequence[Gap]) -> tuple[float, float, int]:
    """Largest relative gap, largest violation, and how many references met their own tolerance."""
    certain = [each for each in found if each.certain]
    relative = max((abs(each.relative) for each in certain), default=float("nan"))
    return relative, max(each.violation for each in found), len(certain)


def exits(reasons: np.ndarray) -> dict[str, int]:
    """How many ticks ended for each reason that is not a solution of the first solver."""
    return {reason.name: int(np.sum(reasons == reason)) for reason in Reason if reason > Reason.SOFTENED}
