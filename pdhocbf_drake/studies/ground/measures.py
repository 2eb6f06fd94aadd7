"""What a walk over uneven ground is judged by."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.commands import known_ground
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.shared.checks import Check, least, most
from pdhocbf_drake.systems.signals import stretch
from pdhocbf_drake.walking.edges import Edges

LEAST_FROM_EDGES = 5.0  # of a swinging sole [mm]
_RECOVERING = float(Reason.RECOVERING), float(Reason.NO_STEADY_PLAN)


def clean(row: str, scenario: Scenario, log: RunLog, metrics: Metrics) -> list[Check]:
    """Checks of a walk on known ground: no fall, recovery or torque at its limit, soles off the edges."""
    found = [
        most(row, "falls", float(metrics.ending != "finished"), 0.0)._replace(combine="sum"),
        most(row, "ticks of recovery", recovery(log), 0.0, "%"),
        most(row, "torques at their limits", float(metrics.torque_limit_hits or 0), 0.0)._replace(combine="sum"),
    ]
    distance = from_edges(scenario, log)
    if math.isfinite(distance):
        found.append(least(row, "swinging soles from edges", 1e3 * distance, LEAST_FROM_EDGES, "mm"))
    return found


def survived(row: str, share: float, scenario: Scenario, log: RunLog) -> list[Check]:
    """Checks of one of many walks: a share of them must not fall; and how far it comes, over what is commanded."""
    upright = float(log.ending == "finished")
    found = [
        least(row, "walks that don't fall", 100.0 * upright, 100.0 * share, "%"),
        most(row, "ticks of recovery", recovery(log), 100.0, "%"),
    ]
    if upright:
        found.append(least(row, "way over the commanded one", _way(scenario, log), 0.5))
    return [check._replace(combine="mean") for check in found]


def sensors(seed: int) -> dict[str, Any]:
    """The `measurement` keys of the walk on sensors, with the errors of a seed."""
    return {**load_scenario("walking_sensors").to_dict()["measurement"], "seed": seed}


def _way(scenario: Scenario, log: RunLog) -> float:
    """How far the CoM has come, over what equal steps of `gait.stride` come to."""
    gait = scenario.gait
    commanded = gait.stride / (gait.ticks_per_step * gait.tick) * (log.time[-1] - log.time[0])
    return float(log.element("lip_state", "x")[-1]) / commanded


def recovery(log: RunLog) -> float:
    """Share of the ticks at which the walk was planned as a disturbed one [%]."""
    return 100.0 * float(np.isin(log.element("solver_status", "reason"), _RECOVERING).mean())


def from_edges(scenario: Scenario, log: RunLog) -> float:
    """Least distance of a swinging sole, as measured, from an edge of the known ground; infinite without one [m]."""
    ground, distance = known_ground(scenario), math.inf
    assert ground is not None
    for side, aloft in (("left", "left_aloft"), ("right", "right_aloft")):
        place = log["foot_state"][:, stretch("foot_state", f"{side}_x", f"{side}_z")]
        swings = log.element("ground_reference", aloft) > 0.0
        y = float(np.median(log.element("foot_state", f"{side}_y")))
        x, z = place[swings].T
        if not len(x):
            continue
        reach = 2.0 * ground.half
        edges = ground.edges((float(x.min()) - reach, y), (float(x.max()) + reach, y))
        if edges:
            distance = min(distance, Edges.least_distance(edges, x, z, ground.half))
    return distance
