"""The table: every row is walked from several seeds, beside the exact walk."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from pdhocbf_drake.studies.sensing import walks
from pdhocbf_drake.studies.sensing.rows import EXACT, ROWS
from pdhocbf_drake.studies.shared.checks import Check
from pdhocbf_drake.studies.shared.row_kinds import Table


def beside_exact(checks: Iterable[Check]) -> list[Check]:
    """One check for each row and what is measured of it; limits on the ZMP count from the exact walk's share."""
    together = TABLE.in_order(checks)
    exact = next((check.value for check in together if (check.row, check.what) == (EXACT, walks.ZMP)), 0.0)
    return [check._replace(limit=check.limit + exact) if check.what == walks.ZMP else check for check in together]


TABLE: Final = Table(
    dict.fromkeys(ROWS, walks),
    always=[EXACT],
    stride=True,
    order=lambda walk: -ROWS[walk.row].duration,  # the longest first
    together=beside_exact,
)
