"""A command straight ahead, beside the stride of the same speed."""

from __future__ import annotations

from typing import Any, Final

from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.analysis.report import metrics_of
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.checks import Outcome, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work, fallen, upright, walked

ROW: Final = "straight"
_DURATION, _QUICK = 10.0, 4.0  # [s]
_SAME = 1.0  # [%]
_COMPARED = (
    "mean_speed", "com_rms_error", "stance_width", "zmp_margin_min", "joint_torque_peak", "sole_gap_min",
)  # fmt: skip


def plan(row: str, asked: Asked) -> list[Work]:
    """One pair of walks."""
    return [Work(row, asked.scenario, {"duration": _QUICK if asked.quick else _DURATION})]


def measure(work: Work) -> Outcome:
    """Walks twice, and compares the metrics of the settled walks."""
    gait, duration = work.with_keys().gait, work.setting["duration"]
    speed = gait.stride / (gait.ticks_per_step * gait.tick)
    command = {"time": 0.0, "velocity": [speed, 0.0]}
    ahead, commanded = work.with_keys(duration=duration), work.with_keys(duration=duration, commands=[command])
    log, whole = walked(commanded, work.run_folder)
    worst = max(_differences(_settled(ahead, walked(ahead)[0]), _settled(commanded, log)))
    return Outcome(
        [*upright(ROW, whole), most(ROW, "difference from the walk at gait.stride", 100.0 * worst, _SAME, "%")],
        fallen(ROW, whole),
    )


def _settled(scenario: Scenario, log: RunLog) -> Metrics:
    return metrics_of(Run.of(scenario, log.after(scenario.from_time)))


def _differences(one: Metrics, other: Metrics) -> list[float]:
    """Relative differences of what both have."""
    before, after = one.model_dump(), other.model_dump()
    pairs = [(before[name], after[name]) for name in _COMPARED]
    pairs += [(barrier.h_min, other.barriers[name].h_min) for name, barrier in one.barriers.items()]
    values = [(a, b) for pair in pairs for a, b in zip(_listed(pair[0]), _listed(pair[1]), strict=True)]
    return [abs(b - a) / abs(a) for a, b in values if a is not None and b is not None and a]


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]
