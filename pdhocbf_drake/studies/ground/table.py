"""The rows of the table: their kinds, in its order."""

from __future__ import annotations

from typing import Final

from pdhocbf_drake.studies.ground import courses, held, known, pushes, sensed, unknown
from pdhocbf_drake.studies.shared.row_kinds import Table

TABLE: Final = Table(
    {
        **dict.fromkeys(known.ROWS, known),
        courses.ROW: courses,
        pushes.ROW: pushes,
        held.ROW: held,
        sensed.ROW: sensed,
        **dict.fromkeys(unknown.ROWS, unknown),
    },
    flat=True,
)
