"""Walks along waypoints: a square and an S."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from pdhocbf_drake.studies.shared.checks import Outcome, least, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work, bounded, fallen, upright, walked

_SIDE = 2.0  # [m]
_QUICK = {"square": (0.4, 22.0), "S": (0.8, 16.0)}  # side [m] and duration [s]; of a shorter S turns are too sharp
_FROM_PATH = 0.06  # [m]
_DURATION = 60.0  # longer than any of them takes [s]
ROWS: Final = ("square", "S")


def points(row: str, side: float) -> list[list[float]]:
    """The waypoints: around a square, or along a period of a sine over its side [m]."""
    if row == "square":
        return [[side, 0.0], [side, side], [0.0, side], [0.0, 0.0]]
    x = np.linspace(0.0, side, 21)[1:]
    return np.column_stack([x, side / 4.0 * np.sin(2.0 * math.pi * x / side)]).tolist()


def plan(row: str, asked: Asked) -> list[Work]:
    """The walk of a row; where quick, along a shorter path."""
    side, duration = _QUICK[row] if asked.quick else (_SIDE, _DURATION)
    return [Work(row, asked.scenario, {"points": points(row, side), "duration": duration})]


def measure(work: Work) -> Outcome:
    """Walks along the waypoints."""
    path = work.setting["points"]
    scenario = work.with_keys(duration=work.setting["duration"], path=path)
    log, metrics = walked(scenario, work.run_folder)
    here = np.array(metrics.position or [math.nan] * 2, dtype=float)
    row, away = work.row, float(np.linalg.norm(here - path[-1]))
    error = None if metrics.path_error_max is None else 100.0 * metrics.path_error_max
    return Outcome(
        [
            *upright(row, metrics),
            *bounded(row, metrics),
            most(row, "distance from the path", error, 100.0 * _FROM_PATH, "cm"),
            most(row, "distance from the last point", 100.0 * away, 100.0 * _FROM_PATH, "cm"),
            least(row, "stands at the end", float(log.element("gait_phase", "support")[-1] == 0.0), 1.0),
        ],
        fallen(row, metrics),
    )
