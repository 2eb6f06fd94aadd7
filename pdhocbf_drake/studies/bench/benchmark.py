"""The whole benchmark as one function: what is measured, in which order, and the numbers that come out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp import has_daqp
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.bench import accuracy, growth, loops, other_solvers, startup
from pdhocbf_drake.studies.bench.parts import parts
from pdhocbf_drake.studies.bench.recording import record
from pdhocbf_drake.studies.bench.reference import Gap
from pdhocbf_drake.studies.bench.routes import Core, Ours, Rebuilt, Route, Updated, sparse_qps
from pdhocbf_drake.studies.bench.timing import time_routes, typical

Tell = Callable[[float], None]


class Effort(NamedTuple):
    """How much is measured: `FULL` or `QUICK`."""

    ticks: int  # recorded of each run
    passes: int
    other_solvers: bool
    judged: int  # ticks of each run compared with the reference
    long_run: int  # perturbed ticks whose exits are counted
    robot_seconds: float
    template_seconds: float
    plant_steps: tuple[float, ...]
    steps_seconds: float
    memory_seconds: float
    gaits: tuple[tuple[int, int], ...]  # (ticks of a gait, horizon)
    rounds: int  # of starts and template loops


FULL = Effort(
    480, 5, True, 240, 10_000, 10.0, 4.0, (0.001, 0.002, 0.0025, 0.005, 0.01), 10.0, 60.0,
    ((80, 80), (80, 160), (80, 320), (40, 80), (40, 160), (160, 160), (160, 320)), 5,
)  # fmt: skip
QUICK = Effort(80, 3, False, 6, 400, 1.0, 2.0, (0.001, 0.005), 3.0, 1.5, ((80, 80), (80, 160)), 1)


def measure(effort: Effort, tell: Tell) -> dict[str, Any]:
    """All numbers of the benchmark, as JSON data.

    Raises:
        InputError: DAQP is not installed, so that there is nothing to compare.
    """
    if not has_daqp():
        raise InputError("the benchmark compares DAQP with other solvers, and daqp is not installed: pip install daqp")
    walk = build_walk(load_scenario("vhip"))
    results: dict[str, Any] = {"ratios": {}}
    qps = sparse_qps(walk)
    drake = [Rebuilt(walk, qps), Updated(walk, qps)]
    others = [kind(walk, qps) for kind in other_solvers.installed()] if effort.other_solvers else []
    _time_ticks(effort, walk, drake, others, results, tell)
    _judge(effort, walk, drake, others, results, tell)
    results["rest"] = parts(walk, record(walk, min(effort.ticks, 160), perturbed=True).ticks, effort.passes)

    tell(0.5)
    results["template"] = loops.template_loop(effort.template_seconds, effort.rounds)
    tell(0.55)
    results["robot"] = loops.robot_loop(effort.robot_seconds)
    tell(0.65)
    results["plant_steps"] = loops.plant_steps(list(effort.plant_steps), effort.steps_seconds)
    tell(0.8)
    results["growth"] = growth.grow(list(effort.gaits), effort.passes)
    results["growth_exponent"] = growth.exponent(results["growth"], 80)
    tell(0.9)
    start = startup.start_up("walking", effort.rounds)
    grown = startup.resident_growth(load_scenario("walking"), effort.memory_seconds, effort.memory_seconds / 3.0)
    results["start_up"] = {
        "import_drake_seconds": start.imported,
        "ready_seconds": start.ready,
        "prepared_seconds": start.prepared,
    }
    results["resident_growth_bytes"] = grown

    same = [row for row in results["plant_steps"] if row["same_walk"]]
    results["ratios"] |= {
        "robot_over_bare_plant": results["robot"]["robot_over_bare_plant"],
        "template_real_time_factor": results["template"]["real_time_factor"],
        "robot_real_time_factor": max(row["real_time_factor"] for row in same),
        "start_over_import": start.ready / start.imported,
    }
    return results


def _time_ticks(
    effort: Effort, walk: Walk, drake: list[Route], others: Sequence[Route], results: dict[str, Any], tell: Tell
) -> None:
    """The routes on the same nominal and perturbed ticks."""
    routes = [Ours(walk), Core(walk), *drake]
    block = walk.gait.period
    results["ticks"], ratios = {}, results["ratios"]
    for run, perturbed in (("nominal", False), ("perturbed", True)):
        ticks = record(walk, effort.ticks, perturbed).ticks
        started = 0.15 * perturbed

        def told(share: float, started: float = started) -> None:
            tell(started + 0.15 * share)

        seconds = time_routes(routes, ticks, effort.passes, block, told)
        if others:
            seconds |= time_routes(others, ticks[:block], 1, block, told)
        results["ticks"][run] = {name: _summary(times) for name, times in seconds.items()}
        ours = typical(seconds["ours"])
        ratios[f"stock_over_ours_{run}"] = float(np.median(typical(seconds["Drake rebuilt"]) / ours))
        if perturbed:
            raw = seconds["ours"]
            ratios["ours_over_core"] = float(np.median(ours / typical(seconds["solver core"])))
            ratios["p99_over_median"] = float(np.quantile(ours, 0.99) / np.median(ours))
            ratios["p99_over_median_every_pass"] = float(np.quantile(raw, 0.99) / np.median(raw))


def _summary(times: np.ndarray) -> dict[str, float]:
    each = typical(times)
    return {
        "seconds_median": float(np.median(each)),
        "seconds_p99": float(np.quantile(each, 0.99)),
        "ticks": float(len(each)),
    }


def _judge(
    effort: Effort, walk: Walk, drake: list[Route], others: Sequence[Route], results: dict[str, Any], tell: Tell
) -> None:
    """Accuracy of every route, and what a long perturbed walk does to the solver."""
    found: dict[str, list[Gap]] = {}
    for perturbed in (False, True):
        tell(0.3 + 0.1 * perturbed)
        ticks = record(walk, effort.ticks, perturbed, seed=1).ticks
        chosen = ticks[:: max(1, len(ticks) // effort.judged)]
        few = 10 if others else 0
        for gaps in (accuracy.gaps(walk, chosen[few:], drake), accuracy.gaps(walk, chosen[:few], [*drake, *others])):
            for name, each in gaps.items():
                found.setdefault(name, []).extend(each)
    table = {name: accuracy.worst(gaps) for name, gaps in found.items()}
    counted = accuracy.exits(record(walk, effort.long_run, perturbed=True, seed=2).reasons)
    results["accuracy"] = {
        "relative_gap_max": table["ours"][0],
        "violation_max": table["ours"][1],
        "references": len(found["ours"]),
        "references_certain": table["ours"][2],
        "ticks_of_exits": effort.long_run,
        "non_optimal_exits": counted["CROSS_SOLVED"] + counted["NOT_OPTIMAL"],
        "exits": counted,
        "routes": {name: {"relative_gap_max": row[0], "violation_max": row[1]} for name, row in table.items()},
    }
