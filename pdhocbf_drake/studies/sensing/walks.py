"""One walk of the table: where it starts, and what is measured of it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from pdhocbf_drake.analysis.estimate import position_drift
from pdhocbf_drake.analysis.feet import slip_max
from pdhocbf_drake.analysis.metrics_schema import EstimatorMetrics
from pdhocbf_drake.analysis.report import metrics_of
from pdhocbf_drake.estimation import Notice
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import FINISHED, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.sensing.rows import ROWS
from pdhocbf_drake.studies.shared.checks import Check, Outcome, least, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.yaml_text import merge

ZMP = "ZMP outside its box"
_FARTHEST = 100.0  # from the origin, at which a walk starts [m]
_QUICK = 6.0  # [s]
_SETTLED = 4.0  # [s] of a walk whose speed is not judged, or half of it where it is shorter
_SLIPPED = 1e-3  # way of a sole on the ground from which on it must be noticed [m]
_DISTURBED = (Reason.RECOVERING, Reason.NO_STEADY_PLAN)


class Walk(NamedTuple):
    """A walk of the table: its row, the scenario as JSON, the seed, and its length [s]; None is that of the row."""

    row: str
    scenario: str
    seed: int
    duration: float | None = None

    def sensed(self) -> Scenario:
        """The scenario to walk; raises `InputError`.

        Seed 0 walks ahead from the origin. The others start anywhere, in any heading, so that wind and slope come from
        any side.
        """
        row, scenario = ROWS[self.row], Scenario.model_validate_json(self.scenario)
        changes: dict[str, Any] = {"seed": self.seed, "duration": self.duration or row.duration}
        if self.seed:
            x, y, yaw = np.random.default_rng(self.seed).uniform(-1.0, 1.0, 3).tolist()
            changes["start"] = {"position": [_FARTHEST * x, _FARTHEST * y], "yaw": math.pi * yaw}
        return Scenario.from_dict(merge(merge(scenario.to_dict(), row.changes), changes), self.row)


def plan(row: str, asked: Asked) -> list[Walk]:
    """A walk for each seed, 0 first; where quick, a few seconds of it."""
    walks = [Walk(row, asked.scenario, seed, _QUICK if asked.quick else None) for seed in range(asked.numbers["seeds"])]
    for walk in walks:
        walk.sensed()
    return walks


def measure(walk: Walk) -> Outcome:
    """Walks, and puts what is measured beside the limits of its row."""
    row, scenario = ROWS[walk.row], walk.sensed()
    log = simulate(scenario)
    metrics = metrics_of(Run.of(scenario, log, 0.0))
    fell = log.ending != FINISHED
    found = [most(walk.row, "falls", float(fell), 0.0)._replace(combine="sum")]
    if row.speed is not None:
        found.append(least(walk.row, "speed", 0.0 if fell else 100.0 * speed(scenario, log), row.speed, "%"))
    limit, outside = math.inf if row.zmp is None else row.zmp, 100.0 * (metrics.zmp_outside_fraction or 0.0)
    found.append(most(walk.row, ZMP, outside, limit, "%")._replace(combine="mean"))
    reasons = log.element("solver_status", "reason")
    found.append(most(walk.row, "recovery", 100.0 * np.isin(reasons, _DISTURBED).mean(), math.inf, "%"))
    if row.estimate and metrics.estimator is not None:
        found.append(_drift(walk.row, metrics.estimator, scenario, log))
        found += _estimate_checks(walk.row, metrics.estimator)
        below = (log.after(scenario.from_time)["h"] < 0.0).any(axis=1) if metrics.barriers else np.zeros(1)
        found.append(most(walk.row, "ticks with h < 0", 100.0 * below.mean(), math.inf, "%")._replace(combine="mean"))
    if row.notice is not None and not (row.notice == Notice.SLIP and slip_max(log) < _SLIPPED):
        notices = log.element("estimator_status", "notice").astype(int)
        seen = (notices & row.notice) == row.notice
        found.append(least(walk.row, "ticks noticed", float(seen.sum()), 1.0))
    for name, barrier in metrics.barriers.items():
        found.append(least(walk.row, f"h of {name}", barrier.h_min, -math.inf, barrier.unit))
    what = f"{walk.row}, seed {walk.seed}"
    return Outcome(found, [f"{what} ended ({log.ending}) at {log.time[-1]:.2f} s"] if fell else [])


def _estimate_checks(row: str, found: EstimatorMetrics) -> list[Check]:
    """Medians over the seeds."""
    vx, vy = found.velocity_rms
    checks = [
        most(row, "yaw drift", found.yaw_drift_deg_per_minute, 1.0, "deg/min"),
        most(row, "height RMS", 1e3 * found.height_rms, 5.0, "mm"),
        most(row, "forward velocity RMS", 1e3 * vx, 6.0, "mm/s"),
        most(row, "lateral velocity RMS", 1e3 * vy, math.inf, "mm/s"),
        least(row, "gaits with NEES below its limit", 100.0 * found.nees_within, 90.0, "%"),
        least(row, "NEES", found.nees, 0.5),
    ]
    return [check._replace(combine="median") for check in checks]


def _drift(row: str, found: EstimatorMetrics, scenario: Scenario, log: RunLog) -> Check:
    """Of the way; of a walk on the spot, which has none, in millimetres and without a limit. The median over seeds."""
    if scenario.gait.stride:
        drift = math.nan if found.position_drift is None else 100.0 * found.position_drift
        return most(row, "drift of the way", drift, 1.0, "%")._replace(combine="median")
    drift = 1e3 * position_drift(log, scenario.gait.ticks_per_gait)
    return most(row, "drift", drift, math.inf, "mm")._replace(combine="median")


def speed(scenario: Scenario, log: RunLog) -> float:
    """Way from gait to gait over the commanded one, once the walk has settled [1]."""
    gait = scenario.gait.ticks_per_gait
    first = round(min(_SETTLED, scenario.duration / 2.0) / scenario.tick)
    gaits = (len(log) - 1 - first) // gait
    com = log["lip_state"][:, [0, 3]]
    way = com[-1] - com[-1 - gaits * gait] if gaits > 0 else np.full(2, np.nan)
    return float(np.hypot(*way)) / (2.0 * abs(scenario.gait.stride) * max(gaits, 1))
