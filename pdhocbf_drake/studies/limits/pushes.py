"""Pushes that are survived at 0.1 m a step, by the robot itself and where a joint has 0.8 of its peak.

The peak is that of the scenario's own walk, so that the robots are those of the other rows.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Final, NamedTuple

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.robot import ROLES, Biped
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.limits.weak import Peaks, write_weak
from pdhocbf_drake.studies.shared.cases import NONE
from pdhocbf_drake.studies.shared.checks import Outcome, least, most
from pdhocbf_drake.studies.shared.push_search import Settings, search_all
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.yaml_text import merge

ROWS: Final[dict[str, str | None]] = {"pushes": None, **{f"pushes, {role} torque 80 %": role for role in ROLES}}
"""The role that is weak, by the name of the row."""

_SHARE = 0.8  # of its peak torque, and of the impulse that is survived then
_STRIDE = 0.1  # at most [m]
_LEAST = {"ahead": 14.5, "back": 24.0, "aside": 9.0}  # medians of a robot of that mass [N s]
_MASS = 29.0  # [kg]
_WAYS = {"+x": "ahead", "-x": "back", "+y": "aside", "-y": "aside"}
_PER_STEP = 2  # ticks of a step at which pushes begin; in the other step left and right are exchanged
_PUSH = Settings(tolerance=1.0, duration=0.1, watch=3.2)


class Pushed(NamedTuple):
    """Pushes in one direction: their row, the scenario as JSON, and the peaks of its own walk."""

    row: str
    scenario: str
    peaks: Peaks
    direction: str


def pushed(work: Pushed, role: str | None, folder: str) -> Scenario:
    """The walk that is pushed; of a robot whose role is weak, its file is written into a folder."""
    scenario = Scenario.model_validate_json(work.scenario)
    changes: dict[str, Any] = {"gait": {"stride": min(scenario.gait.stride, _STRIDE)}}
    scenario = Scenario.from_dict(merge(scenario.to_dict(), changes), work.row)
    if role is None:
        return scenario
    weak = role, _SHARE * work.peaks.torque[ROLES.index(role)]
    return write_weak(scenario, weak, None, Path(folder) / "robot.yaml")


def phases_of(scenario: Scenario) -> tuple[int, ...]:
    """Ticks of a step at which pushes begin."""
    return tuple(scenario.gait.ticks_per_step * part // _PER_STEP for part in range(_PER_STEP))


def least_impulse(way: str, mass: float, role: str | None) -> float:
    """What a robot of that mass [kg] must survive "ahead", "back" or "aside", where a role is weak [N s]."""
    return _LEAST[way] * mass / _MASS * (1.0 if role is None else _SHARE)


def plan(row: str, asked: Asked) -> list[Pushed]:
    """A piece for each direction."""
    return [Pushed(row, asked.scenario, asked.prepared, direction) for direction in _WAYS]


def measure(work: Pushed) -> Outcome:
    """Searches the largest survived impulse at each tick, without barriers."""
    role, way = ROWS[work.row], _WAYS[work.direction]
    with tempfile.TemporaryDirectory() as folder:
        scenario = pushed(work, role, folder)
        mass, phases = Biped.load(scenario.robot).mass, phases_of(scenario)
        wanted = least_impulse(way, mass, role)
        try:
            searches = search_all(scenario, [NONE], [work.direction], phases, _PUSH, 1, mass)
            found = [impulse.survived for impulses in searches for impulse in impulses]
        except ModelError as error:
            return Outcome([most(work.row, "refused", 1.0, 0.0)], [f"{work.row}: {error}"])
    what = f"median of what is survived {way}"
    return Outcome(
        [least(work.row, what, survived, wanted, "N s")._replace(combine="median") for survived in found],
        [f"{work.row}, {work.direction}: {found} N s at ticks {list(phases)}"],
    )
