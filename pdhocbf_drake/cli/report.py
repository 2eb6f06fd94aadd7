"""`pdhocbf report`: a run's report, rebuilt from its log, or one page for several runs."""

from __future__ import annotations

import argparse
from pathlib import Path

from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.files.places import check_file
from pdhocbf_drake.simulation.run_folder import REPLAY, REPORT, Run, read_run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Runs, and the file to write."""
    parser.add_argument("runs", type=Path, nargs="+", metavar="RUN")
    parser.add_argument("--out", type=Path, metavar="FILE", help="where to write it; ./comparison.html for several")


def run(options: argparse.Namespace) -> int:
    """Writes the report, for a single run its metrics and figures too, and prints the report's path."""
    folders: list[Path] = options.runs
    runs = [read_run(folder) for folder in folders]
    # Here, since they load Drake: what is no run is refused at once.
    from pdhocbf_drake.analysis.products import report
    from pdhocbf_drake.analysis.report import write_metrics, write_report

    if len(runs) == 1 and options.out is None:
        write_report(runs[0], write_metrics(runs[0], folders[0]), folders[0], _replay(runs[0], folders[0]))
        print(folders[0] / REPORT)
        return 0
    place: Path = options.out or Path("comparison.html")
    if place.is_dir():
        raise InputError(f"--out must be the name of a file to write, given the folder {place}")
    check_file(place)
    report(runs, place, replays=[_replay(one, folder) for one, folder in zip(runs, folders, strict=True)])
    print(place)
    return 0


def _replay(recorded: Run, folder: Path) -> str | None:
    """The replay in the run folder, or a new one; None for a log without motion."""
    try:
        return (folder / REPLAY).read_text(encoding="utf-8")
    except OSError:
        pass
    from pdhocbf_drake.analysis.replay import replay_html

    try:
        return replay_html(recorded)
    except RunFolderError:
        return None
