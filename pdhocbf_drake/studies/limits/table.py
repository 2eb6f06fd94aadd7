"""The table: walks at the limits, with the whole-body program and without; pushes; joint barriers; the program."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from pdhocbf_drake.studies.limits import joints, plans, program, pushes, walks
from pdhocbf_drake.studies.limits.rows import BARRIERS, PROGRAM, ROWS
from pdhocbf_drake.studies.limits.weak import Peaks
from pdhocbf_drake.studies.shared.checks import Check, combined
from pdhocbf_drake.studies.shared.row_kinds import Table


def in_order(checks: Iterable[Check]) -> list[Check]:
    """The checks in the order of the rows, the closed form behind the program."""
    order = [name for row in TABLE.kinds for name in (row, row + walks.CLOSED)]
    return combined(sorted(checks, key=lambda check: order.index(check.row)))


TABLE: Final = Table(
    {
        **dict.fromkeys(ROWS, walks),
        **dict.fromkeys(pushes.ROWS, pushes),
        **dict.fromkeys(plans.ROWS, plans),
        BARRIERS: joints,
        PROGRAM: program,
    },
    unless_quick=[*pushes.ROWS, *plans.ROWS],
    stride=True,
    prepare=Peaks.of,
    together=in_order,
)
