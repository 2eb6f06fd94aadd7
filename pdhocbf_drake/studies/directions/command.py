"""`pdhocbf directions`: walks that turn, go sideways, stop and start, beside what they must reach."""

from __future__ import annotations

from typing import Final

from pdhocbf_drake.studies.shared.row_kinds import Table
from pdhocbf_drake.studies.shared.table_study import Number, TableStudy


def _table() -> Table:
    from pdhocbf_drake.studies.directions.table import TABLE

    return TABLE


STUDY: Final = TableStudy(
    "directions",
    some="such as circle,square,random",
    quick="a few seconds of each, without pushes",
    load=_table,
    numbers=(
        Number("walks", 20, 1, "random sequences of commands", quick=2),
        Number("seed", 1, 0, "seed of the random sequences"),
    ),
    walk_folders=True,
)
add_arguments, run = STUDY.add_arguments, STUDY.run
