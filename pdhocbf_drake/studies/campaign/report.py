"""The report of a campaign: survival rates, comparisons of barriers on the same points, maps, and failed runs."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import yaml

from pdhocbf_drake.analysis.page import data_url, filled_page, png
from pdhocbf_drake.studies.campaign.config import CampaignConfig
from pdhocbf_drake.studies.campaign.figures import make_figures
from pdhocbf_drake.studies.campaign.store import FAILED
from pdhocbf_drake.studies.campaign.survival import Row, paired, survival_rate


def campaign_report(title: str, config: CampaignConfig, runs: int, rows: Sequence[Row]) -> str:
    """The report as an HTML page without external resources."""
    return filled_page(
        "studies.campaign",
        title=title,
        description=config.description,
        runs=runs,
        missing=runs - len(rows),
        rates=[_rates(name, rows) for name in config.barriers],
        pairs=[(*pair, *paired(rows, *pair)) for pair in combinations(config.barriers, 2)],
        figures=[(drawn.caption, data_url(png(drawn.figure))) for drawn in make_figures(config, rows)],
        failed=[row for row in rows if row["status"] == FAILED],
        campaign=yaml.safe_dump(config.model_dump(mode="json"), sort_keys=False, allow_unicode=True, width=100),
    )


def _rates(name: str, rows: Sequence[Row]) -> dict[str, str]:
    mine = [row for row in rows if row["barrier"] == name]
    rate, low, high, n = survival_rate(mine)
    return {
        "barrier": name,
        "survived": f"{round((rate or 0) * n)} of {n}",
        "rate": _percent(rate),
        "interval": f"{_percent(low)} to {_percent(high)}",
        "fallbacks": _median(mine, "metrics.mpc.fallbacks"),
        "failures": _median(mine, "metrics.mpc.failures"),
        "slack": _median(mine, "metrics.mpc.slack_max"),
        "seconds": _median(mine, "metrics.wall_seconds"),
    }


def _percent(rate: float | None) -> str:
    return "–" if rate is None else f"{100 * rate:.1f} %"


def _median(rows: Sequence[Row], column: str) -> str:
    values = [row[column] for row in rows if row.get(column) is not None]
    return f"{np.median(values):.3g}" if values else "–"
