"""Everything that a run folder holds beside the log, made from the log."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pdhocbf_drake.analysis.figures import Drawn, make_figures, write_figures
from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.analysis.replay import replay_html
from pdhocbf_drake.analysis.report import ReportedRun, report_html
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.simulation.run_folder import (
    FIGURES,
    METRICS,
    REPORT,
    Run,
    new_run_folder,
    replaced_file,
    writing,
)
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario


def metrics_of(run: Run) -> Metrics:
    """The run in numbers."""
    return compute_metrics(run.scenario, run.log, run.provenance.wall_seconds, robot_limits(run.scenario))


def figures_of(run: Run) -> list[Drawn]:
    """The run in figures."""
    return make_figures(run, robot_limits(run.scenario))


def write_run(folder: str | Path, log: RunLog, scenario: Scenario, *, wall_seconds: float = 0.0) -> Run:
    """Writes a run folder with scenario.yaml, provenance.json, log.npz and metrics.json.

    `report` and `replay` make the pages. A run that is there already is replaced once the new one is complete.

    Args:
        folder: its place.
        log: of the run, from `simulate`.
        scenario: of the run.
        wall_seconds: wall time that the simulation took [s]; 0 is unknown.

    Returns:
        The run, as `read_run(folder)` gives it.

    Raises:
        RunFolderError: the folder can't be written, or holds something that is not a run.
    """
    run = Run.of(scenario, log, wall_seconds)
    with new_run_folder(Path(folder)) as staging:
        run.save(staging)
        write_metrics(run, staging)
    return run


def write_metrics(run: Run, folder: Path) -> Metrics:
    """Writes metrics.json."""
    metrics = metrics_of(run)
    with replaced_file(folder / METRICS) as path:
        path.write_text(metrics.to_json(), encoding="utf-8")
    return metrics


def replay(run: Run, out: str | Path | None = None) -> str:
    """The run's motion as one page that opens from disk, rebuilt from the log.

    Args:
        run: the run.
        out: a file to write the page to, which is replaced.

    Returns:
        The page, HTML.

    Raises:
        RunFolderError: the log is too short to move, or `out` can't be written.
    """
    page = replay_html(run)
    if out is not None:
        _write_page(page, out)
    return page


def report(
    runs: Run | Sequence[Run], out: str | Path | None = None, *, replays: Sequence[str | None] | None = None
) -> str:
    """One page for a run, or for several side by side: summary, figures, replay, scenario and provenance.

    Args:
        runs: the runs.
        out: a file to write the page to, which is replaced.
        replays: the page of each run's replay, or None for a run to show without one; by default they are made from
            the logs.

    Returns:
        The page, HTML.

    Raises:
        InputError: there are no runs. RunFolderError: `out` can't be written.
    """
    every = [runs] if isinstance(runs, Run) else list(runs)
    if not every:
        raise InputError("a report needs at least one run")
    if out is not None:
        _check_writable(Path(out))
    motions = [_motion(run) for run in every] if replays is None else replays
    page = report_html([
        ReportedRun(run, metrics_of(run), figures_of(run), motion) for run, motion in zip(every, motions, strict=True)
    ])  # fmt: skip
    if out is not None:
        _write_page(page, out)
    return page


def write_report(run: Run, metrics: Metrics, folder: Path, motion: str | None) -> None:
    """Writes the figures and report.html, which holds them and the page `motion` of the replay."""
    drawn = figures_of(run)
    write_figures(drawn, folder / FIGURES)
    _write_page(report_html([ReportedRun(run, metrics, drawn, motion)]), folder / REPORT)


def _motion(run: Run) -> str | None:
    """The run's replay; None for a log too short to move."""
    try:
        return replay_html(run)
    except RunFolderError:
        return None


def _write_page(page: str, place: str | Path) -> None:
    """Writes a page, and makes the folder that it is to lie in."""
    path = Path(place)
    _check_writable(path)
    with replaced_file(path) as staging:
        staging.write_text(page, encoding="utf-8")


def _check_writable(place: Path) -> None:
    """Makes the folder of a file; raises `InputError` or `RunFolderError` where the file can't be written."""
    if place.is_dir():
        raise InputError(f"{place} is a folder; the name of a file is needed")
    with writing(place):
        place.absolute().parent.mkdir(parents=True, exist_ok=True)
