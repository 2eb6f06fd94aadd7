"""A tick of ours: the time of each of its steps, and how the whole grows with the horizon and the gait."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pdhocbf_drake.qp import DaqpQp
from pdhocbf_drake.qp.solvers import solve_axes
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.bench.recording import AXES, Tick, now, record, solve, theta, time_routes, typical
from pdhocbf_drake.studies.bench.routes import daqp_solvers, ours

TIMED = 120  # ticks
STEP = 0.4  # duration of a step, however many ticks it has [s]
_PARTS = ("theta", "call", "core")


def parts(walk: Walk, ticks: Sequence[Tick], passes: int) -> dict[str, float]:
    """Seconds of a tick (both axes, medians over the ticks of each tick's median over the passes).

    "theta" is the parameters' assembly. "core" is DAQP's own clock, "call" the rest of the compiled call in which it
    solves both axes: limits at θ, the guessed active set, which DAQP factorizes, and the way back to w, cost and flags.
    "plan" is the rest of the tick.
    """
    solvers = daqp_solvers(walk)
    rows = np.empty((passes, len(ticks), len(_PARTS) + 1))
    for number in range(passes):
        for i, given in enumerate(ticks):
            phase = given.tick % walk.gait.period
            spent = _own(solvers[0][phase], solvers[1][phase], walk, given)
            start = now()
            solve(walk.mpc, given)
            rows[number, i] = [*spent, now() - start]
    medians = np.median(np.median(rows, axis=0), axis=0)
    table = dict(zip((*_PARTS, "whole"), map(float, medians), strict=True))
    return {**table, "plan": table["whole"] - sum(medians[:-1])}


def _own(x: DaqpQp, y: DaqpQp, walk: Walk, given: Tick) -> tuple[float, float, float]:
    """Seconds of each of `_PARTS`."""
    clock, guesses = now, [given.guess(axis) for axis in AXES]
    start = clock()
    parameters = [theta(walk.mpc, given, axis) for axis in AXES]
    assembled = clock()
    solve_axes([x, y], parameters, guesses)
    solved = clock()
    core = x.core_seconds + y.core_seconds
    return assembled - start, solved - assembled - core, core


def grow(cases: list[tuple[int, int]], passes: int) -> list[dict[str, Any]]:
    """One row for each (ticks of a gait, horizon): the median tick, and the time of start-up."""
    rows = []
    for gait, horizon in cases:
        tick = STEP / (gait // 2)
        text = f"{{gait: {{ticks_per_step: {gait // 2}, tick: {tick}}}, mpc: {{horizon: {horizon}}}}}"
        start = now()
        walk = build_walk(load_scenario("vhip", text))
        built = now() - start
        ticks = record(walk, TIMED, perturbed=True).ticks
        seconds = time_routes({"ours": ours(walk)}, ticks, passes, gait // 2)["ours"]
        median = float(np.median(typical(seconds)))
        rows.append({"horizon": horizon, "ticks_per_gait": gait, "tick_seconds_median": median, "start_seconds": built})
    return rows


def exponent(rows: list[dict[str, Any]], gait: int) -> float:
    """p of time ∝ H^p from the shortest to the longest horizon of one gait."""
    same = sorted((row["horizon"], row["tick_seconds_median"]) for row in rows if row["ticks_per_gait"] == gait)
    if len(same) < 2:
        return float("nan")
    (first, low), (last, high) = same[0], same[-1]
    return float(np.log(high / low) / np.log(last / first))
