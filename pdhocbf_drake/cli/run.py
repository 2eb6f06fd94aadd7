"""`pdhocbf run`: a scenario goes in, a run folder comes out."""

from __future__ import annotations

import argparse
import time
from datetime import datetime, timezone
from pathlib import Path

from pydrake.geometry import Meshcat

from pdhocbf_drake.analysis.gave_way import gave_way_rows
from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.analysis.products import write_metrics, write_replay, write_report
from pdhocbf_drake.analysis.summary import summary_rows
from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.simulation.checks import unused_settings
from pdhocbf_drake.simulation.provenance import Provenance
from pdhocbf_drake.simulation.run_folder import REPLAY, REPORT, Run, new_run_folder, write_run
from pdhocbf_drake.simulation.run_log import FELL, FINISHED, INTERRUPTED
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import check_watchable, simulate
from pdhocbf_drake.stopping import interruptible, stop_requests
from pdhocbf_drake.terminal import say, shown_progress, table

_STOPPED = "interrupted after the run"
_ENDED_EARLY = 3  # exit code of a run that fell, or that Drake gave up


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, what to change in it, and where to put the run."""
    what = "a name from `pdhocbf list`, or a YAML file, or FILE:NAME for one of several in a file"
    parser.add_argument("scenario", metavar="SCENARIO", help=what)
    add_overrides(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="the run folder; otherwise a new one in ./runs")
    parser.add_argument("--meshcat", action="store_true", help="show the run live in a browser")
    parser.add_argument("--no-replay", action="store_true", help="leave replay.html out")


def run(options: argparse.Namespace) -> int:
    """Simulates, writes and tells; gives the exit code."""
    scenario = load_scenario(options.scenario, options.text)
    if options.meshcat:
        check_watchable(scenario)
    if unused := unused_settings(scenario):
        say(f"pdhocbf: system {scenario.system} makes no use of what is set for {', '.join(unused)}")
    place = options.out or _new_place(scenario)
    with interruptible(), new_run_folder(place) as folder:
        with stop_requests() as asked:  # what was recorded is written before such a request takes effect
            recorded = _recorded(scenario, options.meshcat)
            write_run(folder, recorded)
            metrics = write_metrics(recorded, folder)
        if asked.is_set():
            done, lost = list[str](), _STOPPED
        else:
            done, lost = _write_pages(recorded, metrics, folder, not options.no_replay)
    _tell([*summary_rows(metrics), *gave_way_rows(recorded)], place, done)
    if lost:
        say(f"pdhocbf: {lost}; `pdhocbf report {place}` makes up what is missing")
    return _exit_code(recorded.log.ending, place) or bool(lost)


def _exit_code(ending: str, place: Path) -> int:
    """0 for a run that reached its duration; of another one, says why and where it is."""
    kept = f"what was recorded is in {place}"
    if ending == FINISHED:
        return 0
    if ending == INTERRUPTED:
        say(f"pdhocbf: interrupted; {kept}")
        return 1
    say(f"pdhocbf: the {'robot fell' if ending == FELL else f'simulation {ending}'}; {kept}")
    return _ENDED_EARLY


def _recorded(scenario: Scenario, live: bool) -> Run:
    started, clock = datetime.now(timezone.utc), time.perf_counter()
    shown = shown_progress(scenario.name, float(scenario.duration), "s simulated")
    with stop_requests() as requested, shown as progress:

        def report(now: float) -> None:
            progress(now)
            if requested.is_set():  # between two ticks, so that the log ends with a whole row
                raise KeyboardInterrupt

        log = simulate(scenario, report, _viewer() if live else None)
    return Run(scenario, log, Provenance.of_run(scenario, started, time.perf_counter() - clock))


def _viewer() -> Meshcat:
    meshcat = Meshcat()
    say(f"live at {meshcat.web_url()}")
    return meshcat


def _write_pages(recorded: Run, metrics: Metrics, folder: Path, with_replay: bool) -> tuple[list[str], str]:
    """Writes replay and report; gives the names of those written, and why others are missing.

    Ctrl-C or a full disk costs only what is missing: the log is there.
    """
    done: list[str] = []
    if len(recorded.log) < 2:
        say("pdhocbf: the run has one row, so there is no replay and no report")
        return done, ""
    try:
        page = None
        if with_replay:
            page = write_replay(recorded, folder)
            done.append(REPLAY)
        write_report(recorded, metrics, folder, page)
        done.append(REPORT)
    except KeyboardInterrupt:
        return done, _STOPPED
    except OSError as error:
        reason = error.strerror or str(error).rpartition(": ")[2]
        return done, f"the run is complete, but {REPORT if REPLAY in done else REPLAY} can't be written: {reason}"
    return done, ""


def _new_place(scenario: Scenario) -> Path:
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    wanted = Path("runs") / f"{scenario.name}-{stamp}"
    place, count = wanted, 1
    while place.exists():
        count += 1
        place = wanted.with_name(f"{wanted.name}-{count}")
    return place


def _tell(rows: list[tuple[str, str]], place: Path, done: list[str]) -> None:
    rows = [*rows, *((name.removesuffix(".html"), str(place / name)) for name in done)]
    if not done:
        rows.append(("run folder", str(place)))
    print(table(rows))
