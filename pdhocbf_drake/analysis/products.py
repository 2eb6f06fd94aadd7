"""Run folders, replays and reports from runs in Python."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pdhocbf_drake.analysis.replay import replay_html
from pdhocbf_drake.analysis.report import report_html, reported, write_metrics
from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.files.file import write_text
from pdhocbf_drake.files.places import check_file
from pdhocbf_drake.simulation.run_folder import Run, new_run_folder
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario


def write_run(folder: str | Path, log: RunLog, scenario: Scenario, *, wall_seconds: float = 0.0) -> Run:
    """Writes a run folder with scenario.yaml, provenance.json, log.npz and metrics.json.

    `report` and `replay` make the pages. An older run in that place is replaced once the new one is complete.

    Args:
        folder: its place.
        log: of the run, from `simulate`.
        scenario: of the run.
        wall_seconds: wall time of the simulation [s]; 0 is unknown.

    Returns:
        The run, as `read_run(folder)` returns it.

    Raises:
        RunFolderError: the folder can't be written, or holds something that is not a run.
    """
    run = Run.of(scenario, log, wall_seconds)
    with new_run_folder(Path(folder)) as staging:
        run.save(staging)
        write_metrics(run, staging)
    return run


def replay(run: Run, out: str | Path | None = None) -> str:
    """The run's motion as one HTML page that opens from disk, made from the log.

    Args:
        run: the run.
        out: a file to write the page to; an older one is replaced.

    Raises:
        InputError: `out` is no file. RunFolderError: it can't be written, or the log has less than two rows of finite
            numbers.
    """
    if out is not None:
        check_file(Path(out))  # before the work
    text = replay_html(run)
    if out is not None:
        write_text(Path(out), text)
    return text


def report(
    runs: Run | Sequence[Run], out: str | Path | None = None, *, replays: Sequence[str | None] | None = None
) -> str:
    """One HTML page for a run, or for several side by side: summary, figures, replay, scenario and provenance.

    Args:
        runs: the runs.
        out: a file to write the page to; an older one is replaced.
        replays: the replay page of each run, or None for a run shown without one; by default they are made.

    Raises:
        InputError: there are no runs, or `out` is no file. RunFolderError: it can't be written.
    """
    every = [runs] if isinstance(runs, Run) else list(runs)
    if not every:
        raise InputError("a report needs at least one run")
    if out is not None:
        check_file(Path(out))  # before the work
    motions = [_motion(run) for run in every] if replays is None else replays
    text = report_html([reported(run, motion) for run, motion in zip(every, motions, strict=True)])
    if out is not None:
        write_text(Path(out), text)
    return text


def _motion(run: Run) -> str | None:
    """The run's replay; None for a log that is too short for one."""
    try:
        return replay_html(run)
    except RunFolderError:
        return None
