"""How a tick's time grows with the horizon and with the length of the gait."""

from __future__ import annotations

from typing import Any

import numpy as np

from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.bench.clock import now
from pdhocbf_drake.studies.bench.recording import record
from pdhocbf_drake.studies.bench.routes import Ours
from pdhocbf_drake.studies.bench.timing import time_routes, typical

TIMED = 120  # ticks
STEP = 0.4  # duration of a step, whatever its ticks [s]


def grow(cases: list[tuple[int, int]], passes: int) -> list[dict[str, Any]]:
    """One row for each (ticks of a gait, horizon): the median tick, and what start-up costs."""
    rows = []
    for gait, horizon in cases:
        tick = STEP / (gait // 2)
        text = f"{{gait: {{ticks_per_step: {gait // 2}, tick: {tick}}}, mpc: {{horizon: {horizon}}}}}"
        start = now()
        walk = build_walk(load_scenario("vhip", text))
        built = now() - start
        ticks = record(walk, TIMED, perturbed=True).ticks
        seconds = time_routes([Ours(walk)], ticks, passes, gait // 2, lambda _: None)["ours"]
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
