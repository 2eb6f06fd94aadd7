"""`pdhocbf ground`: walks over stairs, slopes and blocks, beside what they must reach."""

from __future__ import annotations

from typing import Final

from pdhocbf_drake.studies.shared.row_kinds import Table
from pdhocbf_drake.studies.shared.table_study import Number, TableStudy


def _table() -> Table:
    from pdhocbf_drake.studies.ground.table import TABLE

    return TABLE


STUDY: Final = TableStudy(
    "ground",
    some="such as 'stairs up 0.05,blocks'",
    quick="short ground, and few walks of each kind",
    load=_table,
    numbers=(
        Number("walks", 30, 1, "over each kind of random ground", quick=2),
        Number("seed", 1, 0, "seed of random ground"),
    ),
    walk_folders=True,
)
add_arguments, run = STUDY.add_arguments, STUDY.run
