"""The share of the runs that survive, with its confidence interval."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from scipy.stats import binomtest

from pdhocbf_drake.studies.campaign.store import FAILED
from pdhocbf_drake.studies.shared.endings import SURVIVED


class Rate(NamedTuple):
    """Survivors over n runs, with Wilson's 95 % confidence interval; None where there are no runs."""

    rate: float | None
    low: float | None
    high: float | None
    n: int


Row = Mapping[str, Any]


def survival_rate(rows: Iterable[Row]) -> Rate:
    """The rate over the runs that did not fail."""
    survived = [row["status"] == SURVIVED for row in rows if row["status"] != FAILED]
    if not survived:
        return Rate(None, None, None, 0)
    interval = binomtest(sum(survived), len(survived)).proportion_ci(0.95, method="wilson")
    return Rate(sum(survived) / len(survived), float(interval.low), float(interval.high), len(survived))


def campaign_summary(runs: int, barriers: Sequence[str], rows: Sequence[Row]) -> dict[str, Any]:
    """The contents of campaign.json; `runs` is the number of planned runs, some of which may not have a row."""
    failed = sum(row["status"] == FAILED for row in rows)
    rates = {name: survival_rate(row for row in rows if row["barrier"] == name) for name in barriers}
    return {
        "runs": runs,
        "succeeded": len(rows) - failed,
        "failed": failed,
        "survival": {name: rate._asdict() for name, rate in rates.items()},
    }


def paired(rows: Sequence[Row], first: str, second: str) -> tuple[int, int, int]:
    """The number of points run with both barriers, and of those that only the first (only the second) survived."""
    ended = {(row["point"], row["barrier"]): row["status"] == SURVIVED for row in rows if row["status"] != FAILED}
    points = sorted({point for point, _ in ended})
    both = [(ended[p, first], ended[p, second]) for p in points if (p, first) in ended and (p, second) in ended]
    return len(both), sum(a and not b for a, b in both), sum(b and not a for a, b in both)
