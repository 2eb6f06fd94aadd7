"""Stops at any tick of the gait, and starts after them."""

from __future__ import annotations

from itertools import cycle
from typing import Any, Final

import numpy as np

from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.studies.shared.checks import Check, Outcome, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work, bounded, fallen, upright, walked

ROW: Final = "stop and start"
_PHASES, _QUICK_PHASES = 16, 2
_WALKED, _STOOD = 6, 6  # steps between a start and the step of a stop, and between that and the next start
_MORE_STEPS = 2  # after a stop
_AT_REST = 0.02  # CoM velocity at the end of a stand [m/s]
_WAYS = ({"velocity": [0.375, 0.0]}, {"velocity": [0.2, 0.0], "turn": 0.4}, {"velocity": [0.0, 0.12]}, {"turn": -0.4})


def plan(row: str, asked: Asked) -> list[Work]:
    """Walks of two stops each."""
    count = _QUICK_PHASES if asked.quick else _PHASES
    shares = [(i + 0.5) / count for i in range(count)]
    return [Work(row, asked.scenario, {"shares": shares[i : i + 2], "first": i}) for i in range(0, count, 2)]


def commands(ticks: int, tick: float, shares: list[float], first: int = 0) -> list[dict[str, Any]]:
    """Starts in several ways, and stops that come so far into a gait, as a share of its ticks."""
    step, ways = ticks * tick, cycle([*_WAYS[first % len(_WAYS) :], *_WAYS[: first % len(_WAYS)]])
    found: list[dict[str, Any]] = []
    for i, share in enumerate(shares):
        start = i * (_WALKED + 2 + _STOOD) * step
        stop = start + _WALKED * step + int(2.0 * ticks * share) * tick
        found += [{"time": start, **next(ways)}, {"time": stop, "stop": True}]
    end = len(shares) * (_WALKED + 2 + _STOOD) * step
    return [*found, {"time": end, **next(ways)}]


def measure(work: Work) -> Outcome:
    """Walks, stops and starts."""
    gait = work.with_keys().gait
    asked = commands(gait.ticks_per_step, gait.tick, work.setting["shares"], work.setting["first"])
    end = asked[-1]["time"] + 4 * gait.ticks_per_step * gait.tick
    log, metrics = walked(work.with_keys(duration=end, commands=asked))
    stops = [command["time"] for command in asked if "stop" in command]
    starts = [command["time"] for command in asked if "stop" not in command][1:]
    return Outcome([*upright(ROW, metrics), *bounded(ROW, metrics), *_stands(log, stops, starts)], fallen(ROW, metrics))


def _stands(log: RunLog, stops: list[float], starts: list[float]) -> list[Check]:
    """Steps until each stand, the CoM's velocity at its end, and steps until the walk goes on."""
    speed = np.hypot(log.element("lip_state", "vx"), log.element("lip_state", "vy"))
    found = []
    for stop, start in zip(stops, starts, strict=True):
        between = (log.time > stop) & (log.time <= start)
        found += [
            most(ROW, "steps after a stop", _steps(log, between), _MORE_STEPS),
            most(ROW, "velocity when it stands", float(speed[between][-1]) if between.any() else None, _AT_REST, "m/s"),
            most(ROW, "steps until it starts", _standing(log, start), 2.0),
        ]
    return found


def _steps(log: RunLog, between: np.ndarray) -> float:
    """How many steps of one foot begin within these rows; NaN where the last row is no stand."""
    step, support = log.element("gait_phase", "step")[between], log.element("gait_phase", "support")[between]
    if not len(step) or support[-1] != 0.0:
        return float("nan")
    return float(len(np.setdiff1d(step[support != 0.0], step[:1])))


def _standing(log: RunLog, start: float) -> float:
    """How many steps of both feet there are from a time on until a foot swings; NaN where none does."""
    step, support = log.element("gait_phase", "step"), log.element("gait_phase", "support")
    rows = np.flatnonzero((log.time >= start - 1e-6) & (support != 0.0))
    at = np.flatnonzero(log.time >= start - 1e-6)
    return float(step[rows[0]] - step[at[0]]) if len(rows) else float("nan")
