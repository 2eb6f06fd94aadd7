"""Pushes forward on stairs."""

from __future__ import annotations

from typing import Final

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.studies.ground.known import fitted
from pdhocbf_drake.studies.shared.checks import Outcome, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work, fallen, walked

ROW: Final = "pushes on stairs"
_STAIRS = {"kind": "stairs", "at": 0.8, "rise": 0.05, "tread": 0.25, "count": 10}
_PHASES, _STEP = 4, 9  # of the step in which it starts, which is on the stairs
_IMPULSE, _DURATION = 0.2, 0.1  # over the mass [N s/kg], [s]


def plan(row: str, asked: Asked) -> list[Work]:
    """A walk for each phase of a step."""
    return [Work(row, asked.scenario, {"part": part / _PHASES}) for part in range(1 if asked.quick else _PHASES)]


def measure(work: Work) -> Outcome:
    """Pushes the torso at one phase."""
    scenario = fitted(work.with_keys(barriers={}, ground=[_STAIRS]))
    phase = round(work.setting["part"] * scenario.gait.ticks_per_step)
    force = [_IMPULSE * Biped.load(scenario.robot).mass / _DURATION, 0.0, 0.0]
    push = {"step": _STEP, "phase": phase, "duration": _DURATION, "force": force}
    pushed = scenario.from_dict({**scenario.to_dict(), "pushes": [push]}, ROW)
    _, metrics = walked(pushed)
    fell = most(ROW, "falls", float(metrics.ending != "finished"), 0.0)._replace(combine="sum")
    return Outcome([fell], fallen(f"pushed at tick {phase} of step {_STEP}", metrics))
