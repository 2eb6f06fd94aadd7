"""The rows of the table: their kinds, in its order."""

from __future__ import annotations

from typing import Final

from pdhocbf_drake.studies.ground import courses, held, known, pushes, unknown
from pdhocbf_drake.studies.shared.row_kinds import Table

TABLE: Final = Table(
    {
        **dict.fromkeys(known.ROWS, known),
        courses.ROW: courses,
        pushes.ROW: pushes,
        held.ROW: held,
        **dict.fromkeys(unknown.ROWS, unknown),
    },
    flat=True,
)
