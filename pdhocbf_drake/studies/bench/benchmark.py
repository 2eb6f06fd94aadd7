"""The whole benchmark as one function: its measurements in their order, and the numbers that they give."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp import has_daqp
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.bench import accuracy, loops, other_solvers, own_tick, startup
from pdhocbf_drake.studies.bench.recording import record, time_routes, typical
from pdhocbf_drake.studies.bench.routes import Rebuilt, Route, Updated, core, ours, sparse_qps

Report = Callable[[float], None]
"""Called with the share of the benchmark that is done."""


class Effort(NamedTuple):
    """The amount of work: `FULL` or `QUICK`."""

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


def measure(effort: Effort, report: Report) -> dict[str, Any]:
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
    _time_ticks(effort, walk, drake, others, results, report)
    _judge(effort, walk, drake, others, results, report)
    recorded = record(walk, min(effort.ticks, 160), perturbed=True).ticks
    results["rest"] = own_tick.parts(walk, recorded, effort.passes)

    report(0.5)
    template = results["template"] = loops.template_loop(effort.template_seconds, effort.rounds)
    report(0.55)
    robot = results["robot"] = loops.robot_loop(effort.robot_seconds, 0.001)
    results["robot_at_5_ms"] = loops.robot_loop(effort.robot_seconds, 0.005)
    report(0.65)
    steps = results["plant_steps"] = loops.plant_steps(list(effort.plant_steps), effort.steps_seconds)
    report(0.8)
    results["growth"] = own_tick.grow(list(effort.gaits), effort.passes)
    results["growth_exponent"] = own_tick.exponent(results["growth"], 80)
    report(0.9)
    start = results["start_up"] = startup.start_up("walking", effort.rounds)
    memory = effort.memory_seconds
    results["resident_growth_bytes"] = startup.resident_growth(load_scenario("walking"), memory, memory / 3.0)
    results["ratios"] |= {
        "robot_over_bare_plant": robot["robot_over_bare_plant"],
        "template_real_time_factor": template["real_time_factor"],
        "robot_real_time_factor": max(row["real_time_factor"] for row in steps if row["same_walk"]),
        "estimator_over_mpc_tick": loops.estimator_over_mpc_tick(min(effort.robot_seconds, 4.0)),
        "start_over_import": start["ready_seconds"] / start["import_drake_seconds"],
    }
    return results


def _time_ticks(
    effort: Effort, walk: Walk, drake: Sequence[Route], others: Sequence[Route], results: dict[str, Any], report: Report
) -> None:
    """The routes on the same nominal and perturbed ticks."""
    routes = {"ours": ours(walk), "solver core": core(walk), **{route.name: route.seconds for route in drake}}
    block = walk.gait.period
    results["ticks"], ratios = {}, results["ratios"]
    for run, begun in (("nominal", 0.0), ("perturbed", 0.15)):
        ticks = record(walk, effort.ticks, run == "perturbed").ticks

        def progress(share: float, begun: float = begun) -> None:
            report(begun + 0.15 * share)

        seconds = time_routes(routes, ticks, effort.passes, block, progress)
        seconds |= time_routes({route.name: route.seconds for route in others}, ticks[:block], 1, block)
        results["ticks"][run] = {name: _summary(times) for name, times in seconds.items()}
        own = typical(seconds["ours"])
        ratios[f"stock_over_ours_{run}"] = float(np.median(typical(seconds["Drake rebuilt"]) / own))
    ratios["ours_over_core"] = float(np.median(own / typical(seconds["solver core"])))
    for name, times in (("p99_over_median", own), ("p99_over_median_every_pass", seconds["ours"])):
        ratios[name] = float(np.quantile(times, 0.99) / np.median(times))


def _summary(times: np.ndarray) -> dict[str, float]:
    each = typical(times)
    return {
        "seconds_median": float(np.median(each)),
        "seconds_p99": float(np.quantile(each, 0.99)),
        "ticks": float(len(each)),
    }


def _judge(
    effort: Effort, walk: Walk, drake: Sequence[Route], others: Sequence[Route], results: dict[str, Any], report: Report
) -> None:
    """Accuracy of every route, and the exits of the solver in a long perturbed walk."""
    found: dict[str, list[accuracy.Gap]] = {}
    for perturbed in (False, True):
        report(0.3 + 0.1 * perturbed)
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
