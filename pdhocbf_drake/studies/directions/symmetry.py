"""The same walk from elsewhere, at another heading, and mirrored."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.directions.motions import BODY, WORLD, difference, mirrored, moved
from pdhocbf_drake.studies.shared.checks import Check, Outcome, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work

ROW: Final = "symmetry"
_DURATION, _QUICK = 5.0, 2.4  # [s]
_MOVED, _TURNED = 1e-9, 1e-8  # largest difference, over each signal's size
_COMMANDS: Final[tuple[dict[str, Any], ...]] = (
    {"time": 0.0, "velocity": [0.25, 0.05], "turn": 0.4},
    {"time": 2.0, "velocity": [0.3, 0.0], "turn": -0.3},
)
_OTHER = {"left": "right", "right": "left"}


class Start(NamedTuple):
    """Another start [m, rad], and the largest difference."""

    place: tuple[float, float]
    yaw: float
    limit: float


STARTS: Final = {
    "100 m away": Start((100.0, -100.0), 0.0, _MOVED),
    "at 90°": Start((0.0, 0.0), math.pi / 2, _TURNED),
    "at 180°": Start((0.0, 0.0), math.pi, _TURNED),
    "at 57° elsewhere": Start((3.0, -4.0), 1.0, _TURNED),
}
MIRRORED: Final = "mirrored"


def plan(row: str, asked: Asked) -> list[Work]:
    """A walk for each motion; where quick, for a start at 90° and for the mirror."""
    names = ("at 90°", MIRRORED) if asked.quick else (*STARTS, MIRRORED)
    return [Work(row, asked.scenario, {"quick": asked.quick, "name": name}) for name in names]


def measure(work: Work) -> Outcome:
    """Walks twice, and compares."""
    name, duration = work.setting["name"], _QUICK if work.setting["quick"] else _DURATION
    one = _walk(work, duration, list(_COMMANDS), {})
    if name == MIRRORED:
        return Outcome(_mirror(work, duration, one))
    start = STARTS[name]
    other = _walk(work, duration, list(_COMMANDS), {"position": start.place, "yaw": start.yaw})
    tables = {signal: moved(one, signal, start.place, start.yaw) for signal in WORLD if signal in one}
    tables |= {signal: one[signal] for signal in BODY if signal in one}
    return Outcome([_worst(name, start.limit, tables, other)])


def _mirror(work: Work, duration: float, one: RunLog) -> list[Check]:
    turned = [
        {**command, "velocity": [command["velocity"][0], -command["velocity"][1]], "turn": -command["turn"]}
        for command in _COMMANDS
    ]
    gait = work.with_keys().gait
    mirror = gait.model_copy(update={"first_stance": _OTHER[gait.first_stance]}).model_dump(mode="json")
    other = _walk(work, duration, turned, {}, gait=mirror)
    tables = {signal: mirrored(one, signal) for signal in (*WORLD, *BODY) if signal in one}
    return [_worst(MIRRORED, _TURNED, tables, other)]


def _walk(work: Work, duration: float, commands: list[dict[str, Any]], start: dict[str, Any], **keys: Any) -> RunLog:
    return simulate(work.with_keys(duration=duration, commands=commands, start=start, **keys))


def _worst(name: str, limit: float, tables: dict[str, np.ndarray], log: RunLog) -> Check:
    rows = min(len(log), *(len(table) for table in tables.values()))
    worst = max(
        difference(table[:rows], log[signal][:rows], WORLD[signal].headings if signal in WORLD else ())
        for signal, table in tables.items()
    )
    return most(ROW, f"difference {name}", worst, limit)
