"""Walks over ground that is on the map: stairs, slopes, a turn on a slope."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from pdhocbf_drake.simulation.commands import commanded_gait
from pdhocbf_drake.simulation.ground_choice import chosen_for_ground
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import GROUND_KEYS
from pdhocbf_drake.studies.ground.measures import clean
from pdhocbf_drake.studies.shared.checks import Outcome, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work, bounded, fallen, walked

_STEPS, _QUICK_STEPS = 10, 3  # of stairs
_LENGTH, _QUICK_LENGTH = 3.0, 0.5  # of slopes [m]
_AFTER = 4  # steps on level ground after it
_MARGIN = 0.07  # of the bound on the speed over the orbits of level ground and stairs [m/s]


class Known(NamedTuple):
    """A piece of ground, and what is asked of a walk over it.

    Attributes:
        piece: the piece, without `count` or `length`.
        longest: time of a step at most [s].
        commands: of the walk; none goes straight ahead.
    """

    piece: Mapping[str, Any]
    longest: float
    commands: tuple[Mapping[str, Any], ...] = ()


def _stairs(rise: float, tread: float = 0.25) -> dict[str, Any]:
    return {"kind": "stairs", "at": 0.8, "rise": rise, "tread": tread}


_TURNING = ({"time": 0.0, "velocity": [0.3, 0.0]}, {"time": 3.2, "velocity": [0.3, 0.0], "turn": 0.2})
ROWS: Final = {
    "stairs up 0.05": Known(_stairs(0.05), 0.5),
    "stairs up 0.08": Known(_stairs(0.08), 0.5),
    "stairs up 0.12": Known(_stairs(0.12), 1.0),
    "stairs down 0.05": Known(_stairs(-0.05), 0.6),
    "stairs down 0.08": Known(_stairs(-0.08, 0.3), 0.6),
    "slope up 8": Known({"kind": "slope", "at": 0.8, "angle_deg": 8.0}, math.inf),
    "slope down 8": Known({"kind": "slope", "at": 0.8, "angle_deg": -8.0}, math.inf),
    "slope across 5": Known({"kind": "slope", "at": 0.8, "roll_deg": 5.0}, math.inf),
    "slope across -5": Known({"kind": "slope", "at": 0.8, "roll_deg": -5.0}, math.inf),
    "turning on a slope": Known({"kind": "slope", "at": 0.5, "angle_deg": 5.0}, math.inf, _TURNING),
}
_TURN = 8.0  # [s]


def plan(row: str, asked: Asked) -> list[Work]:
    """The walk of a row."""
    known = ROWS[row]
    long = {"length": _QUICK_LENGTH if asked.quick else _LENGTH} if known.piece["kind"] == "slope" else {}
    steps = {} if long else {"count": _QUICK_STEPS if asked.quick else _STEPS}
    return [Work(row, asked.scenario, {"ground": [{**known.piece, **long, **steps}]})]


def measure(work: Work) -> Outcome:
    """Walks over the row's ground, with the time of a step and the CoM height that it asks for."""
    known, keys = ROWS[work.row], dict(work.setting)
    keys["barriers"] = _bound() if known.piece["kind"] == "stairs" else {}
    scenario = fitted(work.with_keys(**keys, commands=list(known.commands)))
    log, metrics = walked(scenario, work.run_folder)
    checks, time = clean(work.row, scenario, log, metrics), scenario.gait.ticks_per_step * scenario.gait.tick
    if math.isfinite(known.longest):
        checks.append(most(work.row, "time of a step", time, known.longest, "s"))
    note = f"{work.row}: steps of {time:g} s, CoM at {scenario.gait.com_height:g} m"
    return Outcome([*checks, *bounded(work.row, metrics)], [note, *fallen(work.row, metrics)])


def fitted(scenario: Scenario) -> Scenario:
    """The scenario with what its ground asks for, for as long as the walk over it and a few steps after it take."""
    chosen = chosen_for_ground(scenario, frozenset(GROUND_KEYS)).scenario
    gait = commanded_gait(chosen)
    steps = len(gait.footsteps.listed) - 1 + _AFTER
    duration = _TURN if chosen.commands else round(steps * gait.period * gait.config.tick, 3)
    return chosen.model_copy(update={"duration": duration})


def _bound() -> dict[str, Any]:
    bound = {"kind": "orbit", "margin": _MARGIN}
    return {"forward_speed": {"side": "upper", "bound": bound, "gamma": [0.5, 0.5]}}
