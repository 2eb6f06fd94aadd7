"""Pushes that are survived while turning, beside those straight ahead."""

from __future__ import annotations

from statistics import median
from typing import Any, Final

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.cases import PERIODIC
from pdhocbf_drake.studies.shared.checks import Outcome, least
from pdhocbf_drake.studies.shared.push_search import Settings, search_all
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work

ROW: Final = "pushes"
_COMMANDS = {"straight ahead": {"turn": 0.0}, "turning": {"turn": 0.4}}
_SPEED = 0.3  # [m/s]
_DIRECTIONS, _PHASES = ("+x", "-x", "+y", "-y"), 4
_PUSH = Settings(tolerance=1.0, duration=0.1, watch=3.2)
_SHARE = 85.0  # [%]


def plan(row: str, asked: Asked) -> list[Work]:
    """A piece for each direction."""
    return [Work(row, asked.scenario, {"direction": direction}) for direction in _DIRECTIONS]


def measure(work: Work) -> Outcome:
    """Searches the largest survived impulse at each phase, turning and not."""
    way = work.setting["direction"]
    found = {name: _survived(work, command, way) for name, command in _COMMANDS.items()}
    straight, turning = (median(values) for values in found.values())
    note = ", ".join(f"{name} {median(values):g} N s {values}" for name, values in found.items())
    share = 100.0 * turning / straight if straight else None
    return Outcome([least(ROW, f"median {way} while turning", share, _SHARE, "%")], [f"pushes {way}: {note}"])


def _survived(work: Work, command: dict[str, Any], way: str) -> list[float]:
    asked = {"time": 0.0, "velocity": [_SPEED, 0.0], **command}
    scenario: Scenario = work.with_keys(commands=[asked])
    ticks = scenario.gait.ticks_per_gait
    phases = [ticks * i // _PHASES for i in range(_PHASES)]
    searches = search_all(scenario, [PERIODIC], [way], phases, _PUSH, 1, Biped.load(scenario.robot).mass)
    return [impulse.survived for impulses in searches for impulse in impulses]
