"""Walks at one command: a circle, on the spot, sideways, backwards."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.studies.shared.checks import Check, Outcome, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work, bounded, fallen, upright, walked


class Steady(NamedTuple):
    """A command [m/s, rad/s], for how long [s], and the largest error of velocity and turn rate [1]."""

    forward: float
    lateral: float
    turn: float
    duration: float
    tolerance: float


CIRCLE: Final = "circle"
ROWS: Final = {
    CIRCLE: Steady(0.3, 0.0, 0.5, 30.0, 0.05),
    "in place": Steady(0.0, 0.0, 0.5, 20.0, 0.08),
    "to the left": Steady(0.0, 0.15, 0.0, 20.0, 0.08),
    "to the right": Steady(0.0, -0.15, 0.0, 20.0, 0.08),
    "backwards": Steady(-0.25, 0.0, 0.0, 20.0, 0.08),
}
_QUICK = 5.0  # [s]
_ZMP_OUTSIDE = 0.08  # share of the samples of the circle


def plan(row: str, asked: Asked) -> list[Work]:
    """The walk of a row."""
    return [Work(row, asked.scenario, {"duration": _QUICK if asked.quick else ROWS[row].duration})]


def measure(work: Work) -> Outcome:
    """Walks at the row's command."""
    wanted = ROWS[work.row]
    scenario = work.with_keys(
        duration=work.setting["duration"],
        commands=[{"time": 0.0, "velocity": [wanted.forward, wanted.lateral], "turn": wanted.turn}],
    )
    _, metrics = walked(scenario, work.run_folder)
    checks = [*upright(work.row, metrics), *errors(work.row, wanted, metrics)]
    if work.row == CIRCLE:
        checks += bounded(work.row, metrics)
        checks.append(
            most(work.row, "ZMP outside its box", _percent(metrics.zmp_outside_fraction), 100.0 * _ZMP_OUTSIDE, "%")
        )
    return Outcome(checks, fallen(work.row, metrics))


def errors(row: str, wanted: Steady, metrics: Metrics) -> list[Check]:
    """The largest errors of velocity and turn rate over whole gaits, as shares of what is commanded."""
    speed, limit = math.hypot(wanted.forward, wanted.lateral), 100.0 * wanted.tolerance
    ahead, aside, turn = metrics.command_error or [None] * 3
    found = []
    if speed:
        off = None if ahead is None or aside is None else 100.0 * math.hypot(ahead, aside) / speed
        found.append(most(row, "error of the velocity", off, limit, "%"))
    if wanted.turn and not metrics.template:
        off = None if turn is None else 100.0 * turn / abs(wanted.turn)
        found.append(most(row, "error of the turn rate", off, limit, "%"))
    return found


def _percent(value: Any) -> float | None:
    return None if value is None else 100.0 * float(value)
