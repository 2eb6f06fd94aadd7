"""`pdhocbf sensing`: walks with late, noisy and wrong knowledge of the robot, beside what they must reach."""

from __future__ import annotations

from typing import Final

from pdhocbf_drake.studies.shared.row_kinds import Table
from pdhocbf_drake.studies.shared.table_study import Number, TableStudy


def _table() -> Table:
    from pdhocbf_drake.studies.sensing.table import TABLE

    return TABLE


STUDY: Final = TableStudy(
    "sensing",
    some="apart by semicolons, such as 'wind;torso 1.3'",
    quick="one seed, a few seconds of each",
    load=_table,
    separator=";",
    numbers=[Number("seeds", 10, 1, "seeds 0 to N - 1 of each row", quick=1)],
)
add_arguments, run = STUDY.add_arguments, STUDY.run
