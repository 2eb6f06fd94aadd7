"""How much of the pieces of uneven ground a walk has come over, from a log."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis.feet import sole_centres, step_starts, touchdown_rows
from pdhocbf_drake.analysis.heights import above_ground
from pdhocbf_drake.analysis.metrics_schema import PieceMetrics
from pdhocbf_drake.ground.config import Piece, Stairs
from pdhocbf_drake.ground.terrain import Terrain
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario

_SIDES = "left", "right"
_STANDS = 0.02  # [m]: height of a sole's centre over the ground up to which it stands there


def ground_walked(scenario: Scenario, log: RunLog) -> dict[str, PieceMetrics] | None:
    """The pieces of a scenario's ground, between the first and last place where a foot stood; None on level ground."""
    if not scenario.ground:
        return None
    places = _stood(log, scenario.terrain)
    low, high = (float(places.min()), float(places.max())) if len(places) else (0.0, 0.0)
    return {str(number): _walked(piece, low, high) for number, piece in enumerate(scenario.ground)}


def _walked(piece: Piece, low: float, high: float) -> PieceMetrics:
    start, end = piece.span()
    stairs: dict[str, float | int] = {}
    if isinstance(piece, Stairs):
        edges = start + piece.tread * np.arange(piece.count)
        taken = int(((edges > low) & (edges < high)).sum())
        stairs = {"rise": piece.rise, "stairs": piece.count, "stairs_taken": taken}
    way = max(0.0, min(end, high) - max(start, low))
    return PieceMetrics(kind=piece.kind, known=piece.known, length=end - start, walked=way, **stairs)


def _stood(log: RunLog, terrain: Terrain) -> NDArray[np.float64]:
    """x of every stance [m]: of the soles that stand, or on the template of the planned ones."""
    if "foot_state" not in log:
        return log.element("stance_plan", "x_now")[step_starts(log)]
    found = []
    for side in _SIDES:
        rows = touchdown_rows(log, side)
        soles = np.column_stack([sole_centres(log, side), log.element("foot_state", f"{side}_z")])[rows]
        found.append(soles[above_ground(soles, terrain) < _STANDS, 0])
    return np.concatenate(found)
