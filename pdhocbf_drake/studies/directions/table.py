"""The rows of the table: their kinds, in its order."""

from __future__ import annotations

from typing import Final

from pdhocbf_drake.studies.directions import (
    pushes,
    sequences,
    steady,
    stops,
    straight,
    symmetry,
    template,
    waypoints,
)
from pdhocbf_drake.studies.shared.row_kinds import Table

TABLE: Final = Table(
    {
        **dict.fromkeys(steady.ROWS, steady),
        **dict.fromkeys(waypoints.ROWS, waypoints),
        stops.ROW: stops,
        symmetry.ROW: symmetry,
        straight.ROW: straight,
        template.ROW: template,
        sequences.ROW: sequences,
        pushes.ROW: pushes,
    },
    unless_quick=[pushes.ROW],
    order=lambda piece: piece.row != pushes.ROW,  # the longest first
)
