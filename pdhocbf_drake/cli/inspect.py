"""The verbs that simulate nothing: `list`, `compare`, `replay`, `report`."""

from __future__ import annotations

from pathlib import Path

from pdhocbf_drake.analysis.comparison import compare
from pdhocbf_drake.analysis.products import figures_of, metrics_of, write_metrics, write_replay, write_report
from pdhocbf_drake.analysis.replay import replay_html
from pdhocbf_drake.analysis.report import ReportedRun, report_html
from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.simulation.run_folder import REPLAY, REPORT, Run, read_run, replaced_file
from pdhocbf_drake.simulation.scenario_file import load_scenario, scenario_names


def list_scenarios() -> int:
    """Prints each scenario with its one sentence."""
    names = scenario_names()
    width = max(len(name) for name in names)
    for name in names:
        print(f"{name:<{width}}  {load_scenario(name).description}")
    return 0


def compare_runs(first: Path, second: Path, from_time: float) -> int:
    """Prints the safety margins (5) of both runs and their ratio (6)."""
    runs = read_run(first), read_run(second)
    for found in compare(*runs, from_time):
        rows = zip((first, second), runs, found.names, found.margins, strict=True)
        for place, run, name, margin in rows:
            mean = f"mean h {margin:.5g} {found.unit} from {from_time:g} s on"
            print(f"{place}: {run.scenario.name}, barrier {name}: {mean}")
        print(f"M = {100 * found.ratio:.1f} %: {_meaning(found.ratio)}")
    return 0


def replay(folder: Path) -> int:
    """Writes the replay of a run again."""
    write_replay(read_run(folder), folder)
    print(folder / REPLAY)
    return 0


def report(folders: list[Path], out: Path | None) -> int:
    """Writes the report of a run again, with its metrics and figures; or one page for several runs."""
    runs = [read_run(folder) for folder in folders]
    if len(runs) == 1 and out is None:
        write_report(runs[0], write_metrics(runs[0], folders[0]), folders[0], _replay(runs[0], folders[0]))
        print(folders[0] / REPORT)
        return 0
    place = out or Path("comparison.html")
    if place.is_dir():
        raise InputError(f"--out must be the name of a file to write, given the folder {place}")
    pages = [
        ReportedRun(run, metrics_of(run), figures_of(run), _replay(run, folder))
        for run, folder in zip(runs, folders, strict=True)
    ]
    with replaced_file(place) as path:
        path.write_text(report_html(pages), encoding="utf-8")
    print(place)
    return 0


def _replay(run: Run, folder: Path) -> str | None:
    """The replay that the folder holds, or one made now; None for a log without motion."""
    try:
        return (folder / REPLAY).read_text(encoding="utf-8")
    except OSError:
        pass
    try:
        return replay_html(run)
    except RunFolderError:
        return None


def _meaning(ratio: float) -> str:
    if ratio < 0:
        return "the margins have opposite signs: one of the runs left its safe set on average"
    if ratio <= 1:
        return f"the first run's barrier is {100 * (1 - ratio):.1f} % less conservative"
    return f"the first run's barrier is {100 * (ratio - 1):.1f} % more conservative"
