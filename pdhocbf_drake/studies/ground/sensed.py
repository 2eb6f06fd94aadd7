"""Walks up stairs that are on the map, on the estimate from sensors, each with other errors of these."""

from __future__ import annotations

from typing import Final

from pdhocbf_drake.studies.ground.known import ROWS, fitted
from pdhocbf_drake.studies.ground.measures import sensors, survived
from pdhocbf_drake.studies.shared.checks import Outcome
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work, fallen, walked

_STAIRS: Final = "stairs up 0.05"
ROW: Final = f"{_STAIRS} by sensors"
_SHARE: Final = 27 / 30  # of the walks that must reach the end
_STEPS, _QUICK_STEPS = 10, 3  # of the stairs


def plan(row: str, asked: Asked) -> list[Work]:
    """A walk for each draw of the sensors' errors."""
    stairs = {**ROWS[_STAIRS].piece, "count": _QUICK_STEPS if asked.quick else _STEPS}
    setting, first = {"ground": [stairs]}, asked.numbers["seed"]
    return [Work(row, asked.scenario, {**setting, "seed": first + i}) for i in range(asked.numbers["walks"])]


def measure(work: Work) -> Outcome:
    """Walks with one draw."""
    seed, ground = int(work.setting["seed"]), work.setting["ground"]
    scenario = fitted(work.with_keys(ground=ground, barriers={}, measurement=sensors(seed)))
    log, metrics = walked(scenario)
    return Outcome(survived(ROW, _SHARE, scenario, log), fallen(f"{ROW}, walk {seed}", metrics))
