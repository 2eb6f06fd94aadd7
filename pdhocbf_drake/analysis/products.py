"""Everything that a run folder holds beside the log, made from the log."""

from __future__ import annotations

from pathlib import Path

from pdhocbf_drake.analysis.figures import Drawn, make_figures, write_figures
from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.analysis.replay import replay_html
from pdhocbf_drake.analysis.report import ReportedRun, report_html
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.simulation.run_folder import FIGURES, METRICS, REPLAY, REPORT, Run, replaced_file


def metrics_of(run: Run) -> Metrics:
    """The run in numbers."""
    return compute_metrics(run.scenario, run.log, run.provenance.wall_seconds, robot_limits(run.scenario))


def figures_of(run: Run) -> list[Drawn]:
    """The run in figures."""
    return make_figures(run, robot_limits(run.scenario))


def write_metrics(run: Run, folder: Path) -> Metrics:
    """Writes metrics.json."""
    metrics = metrics_of(run)
    with replaced_file(folder / METRICS) as path:
        path.write_text(metrics.to_json(), encoding="utf-8")
    return metrics


def write_replay(run: Run, folder: Path) -> str:
    """Writes replay.html and gives its text."""
    page = replay_html(run)
    with replaced_file(folder / REPLAY) as path:
        path.write_text(page, encoding="utf-8")
    return page


def write_report(run: Run, metrics: Metrics, folder: Path, replay: str | None) -> None:
    """Writes the figures and report.html, which holds them and the replay."""
    drawn = figures_of(run)
    write_figures(drawn, folder / FIGURES)
    page = report_html([ReportedRun(run, metrics, drawn, replay)])
    with replaced_file(folder / REPORT) as path:
        path.write_text(page, encoding="utf-8")
