"""Every microsecond of our tick: the steps that `PeriodicMpc.solve` goes through, timed one by one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdhocbf_drake.qp import DaqpQp
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.studies.bench.clock import now
from pdhocbf_drake.studies.bench.recording import Tick, solve, theta
from pdhocbf_drake.studies.bench.routes import AXES


def parts(walk: Walk, ticks: Sequence[Tick], passes: int) -> dict[str, float]:
    """Seconds of a tick (both axes, medians over the ticks of each tick's median over the passes).

    "theta" is the parameters' assembly; "bounds" their map, with the optimum without constraints; "guess" the warm
    start; "update" hands vectors to DAQP, which factorizes the guessed active set; "core" is DAQP's own clock, "call"
    what its Python interface adds; "decisions" the map to w, with cost and flags; "plan" what is left of the whole.
    """
    mpc = walk.mpc
    solvers = [
        [DaqpQp(qp, problem.bound_rows, problem.guess_rows(qps, phase)) for phase, qp in enumerate(qps)]
        for qps, problem in zip(mpc.qps, mpc.problems, strict=True)
    ]
    rows = np.empty((passes, len(ticks), 8))
    for number in range(passes):
        for i, given in enumerate(ticks):
            total = np.zeros(7)
            for axis in AXES:
                total += _axis(solvers[axis][given.tick % walk.gait.period], walk, given, axis)
            start = now()
            solve(mpc, given)
            rows[number, i] = [*total, now() - start]
    typical = np.median(np.median(rows, axis=0), axis=0)
    names = ("theta", "bounds", "guess", "update", "core", "call", "decisions", "whole")
    table = dict(zip(names, map(float, typical), strict=True))
    return {**table, "plan": table["whole"] - sum(typical[:7])}


def _axis(solver: DaqpQp, walk: Walk, given: Tick, axis: int) -> np.ndarray:
    clock = now
    active = None if given.last is None else given.last.active[axis]
    times = [clock()]
    parameters = theta(walk.mpc, given, axis)
    times.append(clock())
    least = solver.prepare(parameters)
    times.append(clock())
    solver.start_from(active)
    times.append(clock())
    solver.factorize()
    times.append(clock())
    outcome = solver.iterate()
    times.append(clock())
    solver.result(least, outcome)
    times.append(clock())
    spent, core = np.diff(times), solver.core_seconds
    return np.array([*spent[:4], core, spent[4] - core, spent[5]])
