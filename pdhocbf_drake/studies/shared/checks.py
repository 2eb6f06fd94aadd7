"""What a row of the table must reach, and what it reached."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from typing import Final, Literal, NamedTuple

AT_MOST: Final = "≤"
AT_LEAST: Final = "≥"


class Check(NamedTuple):
    """A measured value beside its limit.

    Attributes:
        row, what: the row of the table, and what of it is measured.
        value: the measured value; NaN where there is none, which holds no limit.
        relation: "≤" or "≥".
        limit: in the same unit.
        unit: of both.
        combine: how the values of several walks become one: the worst, the sum, the mean, or the median.
    """

    row: str
    what: str
    value: float
    relation: str
    limit: float
    unit: str
    combine: Literal["worst", "sum", "mean", "median"] = "worst"

    @property
    def holds(self) -> bool:
        """Whether the value keeps its limit."""
        return self.value <= self.limit if self.relation == AT_MOST else self.value >= self.limit


class Outcome(NamedTuple):
    """What a piece of work found: its checks, and sentences on what went wrong."""

    checks: Sequence[Check]
    notes: Sequence[str] = ()


def most(row: str, what: str, value: float | None, limit: float, unit: str = "1") -> Check:
    """A value that must be at most a limit; None is no value."""
    return Check(row, what, math.nan if value is None else float(value), AT_MOST, limit, unit)


def least(row: str, what: str, value: float | None, limit: float, unit: str = "1") -> Check:
    """A value that must be at least a limit; None is no value."""
    return most(row, what, value, limit, unit)._replace(relation=AT_LEAST)


def combined(checks: Iterable[Check]) -> list[Check]:
    """One check for each row and what is measured of it, in the order of their first."""
    groups: dict[tuple[str, str], list[Check]] = {}
    for check in checks:
        groups.setdefault((check.row, check.what), []).append(check)
    return [group[0]._replace(value=_together(group)) for group in groups.values()]


def _together(group: Sequence[Check]) -> float:
    values, first = [check.value for check in group], group[0]
    if any(math.isnan(value) for value in values):
        return math.nan
    if first.combine == "worst":
        return max(values) if first.relation == AT_MOST else min(values)
    if first.combine == "median":
        return statistics.median(values)
    return math.fsum(values) / (len(values) if first.combine == "mean" else 1)
