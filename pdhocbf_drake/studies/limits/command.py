"""`pdhocbf limits`: walks at the limits of joints and ground, beside what they must reach."""

from __future__ import annotations

from typing import Final

from pdhocbf_drake.studies.shared.row_kinds import Table
from pdhocbf_drake.studies.shared.table_study import TableStudy


def _table() -> Table:
    from pdhocbf_drake.studies.limits.table import TABLE

    return TABLE


STUDY: Final = TableStudy(
    "limits",
    some="apart by semicolons, such as 'knee_pitch torque 80 %%;joint barriers'",
    quick="a few seconds of each, without the closed form beside it",
    load=_table,
    separator=";",
)
add_arguments, run = STUDY.add_arguments, STUDY.run
