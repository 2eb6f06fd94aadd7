"""Marker of the CoM as estimated from the sensors, in a replay."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Sphere

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.replay_stage import Stage
from pdhocbf_drake.simulation.run_log import RunLog

ENLARGED = 10.0
"""The ellipsoid of 2σ, some millimetres, is drawn so many times as large."""

_CENTRE, _BAND = "CoM estimated", f"CoM estimated, 2σ x {ENLARGED:.0f}"
_LEAST = 1e-3  # [m]: an ellipsoid is not flatter


class EstimateMarker:
    """The estimated CoM, and about it the ellipsoid of 2σ of its place from the stance foot."""

    def __init__(self, stage: Stage, log: RunLog) -> None:
        self._stage = stage
        com, height = log["lip_estimate"][:, [0, 3]], log.element("com_z_estimate", "z")
        self._places = np.column_stack([com, height])
        self._sizes = np.maximum(2.0 * ENLARGED * log["estimate_deviation"][:, :3], _LEAST)
        stage.add(_CENTRE, Sphere(0.02), palette.RUNS[0])
        stage.add(_BAND, Sphere(1.0), palette.RUNS[0], 0.25)
        stage.through_everything(_CENTRE, 4)

    def draw(self, row: int) -> None:
        """Places it as at that row of the log."""
        place = self._places[row].tolist()
        self._stage.move(_CENTRE, place)
        self._stage.move(_BAND, place)
        self._stage.scale(_BAND, np.round(self._sizes[row], 3).tolist())
