"""One page a run, or one for several side by side; it holds its figures and replays and loads nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import yaml

from pdhocbf_drake.analysis.comparison import comparison_figures
from pdhocbf_drake.analysis.figures import Drawn
from pdhocbf_drake.analysis.gave_way import gave_way_rows
from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.analysis.page import data_url, page, png
from pdhocbf_drake.analysis.summary import summary_rows
from pdhocbf_drake.simulation.run_folder import Run


class ReportedRun(NamedTuple):
    """A run with what is shown of it; `replay` is a page of its own, or None."""

    run: Run
    metrics: Metrics
    figures: list[Drawn]
    replay: str | None


def report_html(runs: Sequence[ReportedRun]) -> str:
    """The page."""
    columns = [dict([*summary_rows(reported.metrics), *gave_way_rows(reported.run)]) for reported in runs]
    names = list(dict.fromkeys(name for column in columns for name in column))
    shared = comparison_figures([reported.run for reported in runs]) if len(runs) > 1 else []
    return page(
        "analysis",
        title=" and ".join(dict.fromkeys(reported.run.scenario.name for reported in runs)),
        labels=_labels(runs),
        rows=[(name, [column.get(name, "–") for column in columns]) for name in names],
        shared=[(drawn.caption, data_url(png(drawn.figure))) for drawn in shared],
        runs=[
            {
                "label": label,
                "description": reported.run.scenario.description,
                "figures": [(drawn.caption, data_url(png(drawn.figure))) for drawn in reported.figures],
                "replay": reported.replay,
                "scenario": _yaml(reported.run.scenario.to_dict()),
                "provenance": _yaml(reported.run.provenance.model_dump()),
            }
            for label, reported in zip(_labels(runs), runs, strict=True)
        ],
    )


def _labels(runs: Sequence[ReportedRun]) -> list[str]:
    """The scenarios' names, numbered where they are the same."""
    names = [reported.run.scenario.name for reported in runs]
    return [name if names.count(name) == 1 else f"{name} ({index + 1})" for index, name in enumerate(names)]


def _yaml(data: object) -> str:
    return yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=100)
