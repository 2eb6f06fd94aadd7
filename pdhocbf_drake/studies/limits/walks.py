"""One walk of the table, and what is measured of it."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.analysis.metrics_schema import TORQUE_KEPT
from pdhocbf_drake.analysis.report import metrics_of
from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.robot import ROLES, Biped
from pdhocbf_drake.simulation.limits import checked_walk
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import FINISHED, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.limits.rows import DEFAULT, ROWS
from pdhocbf_drake.studies.limits.weak import Peaks, write_weak
from pdhocbf_drake.studies.shared.checks import Check, Outcome, least, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.yaml_text import merge

_QUICK = 4.0  # [s]
_WHOLE = 100.0 * (1.0 + 1e-9)  # [%]
CLOSED = ", closed form"


class Walk(NamedTuple):
    """A walk of the table: its row, the scenario as JSON, the peaks of its own walk, the kind of `whole_body`, and
    its length [s], None for that of the row."""

    row: str
    scenario: str
    peaks: Peaks
    kind: str = "auto"
    duration: float | None = None


def plan(row: str, asked: Asked) -> list[Walk]:
    """The walk with the whole-body program, and the closed form beside it; where quick, a few seconds without that."""
    kinds = ["auto"] if asked.quick or ROWS[row].slip is not None else ["auto", "closed_form"]
    return [Walk(row, asked.scenario, asked.prepared, kind, _QUICK if asked.quick else None) for kind in kinds]


def measure(walk: Walk) -> Outcome:
    """Walks, and puts what is measured beside the limits of its row."""
    row, name = ROWS[walk.row], walk.row + (CLOSED if walk.kind == "closed_form" else "")
    data = Scenario.model_validate_json(walk.scenario).to_dict()
    changes = {"duration": walk.duration or row.duration, "whole_body": {"kind": walk.kind}}
    scenario = Scenario.from_dict(merge(merge(data, row.changes or {}), changes), walk.row)
    torque, speed = (
        None if limit is None else (limit[0], limit[1] * peaks[ROLES.index(limit[0])])
        for limit, peaks in ((row.torque, walk.peaks.torque), (row.speed, walk.peaks.speed))
    )
    with tempfile.TemporaryDirectory() as folder:
        if torque or speed:
            scenario = write_weak(scenario, torque, speed, Path(folder) / "robot.yaml")
        try:
            biped, kept = checked_walk(scenario)
        except ModelError as error:
            allowed = math.inf if row.fastest is None or walk.kind == "closed_form" else 0.0
            return Outcome([most(name, "refused", 1.0, allowed)], [f"{name}: {error}"])
        log = simulate(kept.scenario)
        checks = _checks(name, walk, scenario, biped, log)
    notes = [f"{name}: {sentence}" for sentence in kept.sentences]
    return Outcome(checks, [*notes, *([f"{name}: fell at {log.time[-1]:.2f} s"] if log.ending != FINISHED else [])])


def _checks(name: str, walk: Walk, scenario: Scenario, biped: Biped, log: RunLog) -> list[Check]:
    """Judged with the program, shown without."""
    row, judged = ROWS[walk.row], walk.kind != "closed_form"

    def limit(value: float) -> float:
        return value if judged else math.inf

    fell = log.ending != FINISHED
    commanded = abs(scenario.gait.stride) / (scenario.gait.ticks_per_step * scenario.gait.tick)
    later = log.after(min(scenario.from_time, 0.5 * scenario.duration))
    speed = 0.0 if fell else 100.0 * float(np.hypot(*later["lip_state"][:, [1, 4]].mean(axis=0))) / commanded
    planned, metrics = np.abs(log["feedforward"]), metrics_of(Run.of(scenario, log, 0.0))
    reached = math.inf if metrics.torque_limit_fraction is None else metrics.torque_limit_fraction
    rates, joints = np.abs(log["desired_state"][:, 12:]), np.abs(log["joint_state"][:, 12:])
    found = [
        most(name, "falls", float(fell), limit(0.0)),
        least(name, "speed", speed, (row.fastest or 0.0) if judged else -math.inf, "%"),
        most(name, "planned torque of its limit", 100.0 * (planned / biped.effort_limits).max(), limit(_WHOLE), "%"),
        most(name, "samples at a torque's limit", 100.0 * reached, limit(100.0 * TORQUE_KEPT), "%"),
        most(name, "planned speed of its limit", 100.0 * (rates / biped.velocity_limits).max(), limit(_WHOLE), "%"),
        most(name, "measured speed of its limit", 100.0 * (joints / biped.velocity_limits).max(), limit(105.0), "%"),
    ]
    if row.slip is not None:
        slip = math.inf if metrics.slip_max is None else 1e3 * metrics.slip_max
        found.append(most(name, "slip", slip, limit(row.slip), "mm"))
    if metrics.whole_body is not None:
        active = 0.0 if walk.row == DEFAULT else math.inf
        found.append(most(name, "active ticks", metrics.whole_body.active_ticks, active))
        found.append(most(name, "misses", sum(metrics.whole_body.misses.values()), active))
    return found
