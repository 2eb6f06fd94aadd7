"""`pdhocbf run`: simulates a scenario and writes a run folder.

Drake is loaded after the scenario has been checked, and what draws the pages after it has been simulated.
"""

from __future__ import annotations

import argparse
import errno
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.collecting import give_back_memory, quick_imports, without_garbage_collection
from pdhocbf_drake.errors import InputError, PdhocbfError, RunFolderError, reason
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.files.places import writing
from pdhocbf_drake.simulation.checks import check_scenario, unused_settings
from pdhocbf_drake.simulation.not_reached import not_reached
from pdhocbf_drake.simulation.run_folder import ENTRIES, REPLAY, REPORT, ROWS, Run, begin_run
from pdhocbf_drake.simulation.run_log import FELL, FINISHED, INTERRUPTED
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_fitted
from pdhocbf_drake.stopping import interruptible, stop_requests
from pdhocbf_drake.terminal import say, shown_progress, table

if TYPE_CHECKING:
    from pdhocbf_drake.analysis.metrics_schema import Metrics
    from pdhocbf_drake.fitting.defaults import Fitted
    from pdhocbf_drake.simulation.run_log import RunLog

_STOPPED = "interrupted after the run"
_ENDED_EARLY = 3  # exit code of a run that ended in a fall or a failure of Drake


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, its overrides, and the run folder."""
    text = "a name from `pdhocbf list`, or a YAML file, or FILE:NAME for one of several in a file"
    parser.add_argument("scenario", metavar="SCENARIO", help=text)
    add_overrides(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="the run folder; otherwise a new one in ./runs")
    parser.add_argument("--meshcat", action="store_true", help="show the run live in a browser")
    verbose = "say whether programs are compiled or read, and where, and which values fit another robot"
    parser.add_argument("--verbose", action="store_true", help=verbose)
    parser.add_argument("--no-replay", action="store_true", help="leave replay.html out")


def run(options: argparse.Namespace) -> int:
    """Simulates, writes the run folder, prints the summary and returns the exit code."""
    scenario, fitted = load_fitted(options.scenario, options.text)
    check_scenario(scenario)
    _say_fit(scenario, fitted, options.verbose)
    if options.meshcat and scenario.system == "van_der_pol":
        raise InputError("--meshcat: walks can be watched live; the replay shows this scenario's oscillator")
    if unused := unused_settings(scenario):
        say(f"pdhocbf: system {scenario.system} makes no use of what is set for {', '.join(unused)}")
    for sentence in not_reached(scenario):
        say(f"pdhocbf: {sentence}")
    if scenario.system != "van_der_pol" and any(not each.bound.follows_orbit for each in scenario.barriers.values()):
        from pdhocbf_drake.simulation.given_bounds import notes_on_bounds  # here and below, since it loads Drake

        for sentence in notes_on_bounds(scenario):
            say(f"pdhocbf: note: {sentence}")
    if scenario.commands or scenario.path:
        from pdhocbf_drake.simulation.commands import limited_commands

        for sentence in limited_commands(scenario):
            say(f"pdhocbf: {sentence}")
    with interruptible(), run_place(options.out, scenario) as place, new_folder(place, ENTRIES, keep=ROWS) as folder:
        for saved in folder.saved:
            say(f"pdhocbf: a run was killed as it was written to {place}; what it recorded is now in {saved}")
        with stop_requests() as stop:  # the log is written before such a request takes effect
            recorded = _recorded(scenario, options.meshcat, options.verbose, folder.path)
            # Here and below, for a quick start.
            with quick_imports():
                from pdhocbf_drake.analysis.degraded import degraded_rows
                from pdhocbf_drake.analysis.pushes import push_rows
                from pdhocbf_drake.analysis.report import write_metrics
                from pdhocbf_drake.analysis.summary import summary_rows

            recorded.save(folder.path)
            metrics = write_metrics(recorded, folder.path)
            folder.finish()
        written, problem = list[str](), _STOPPED
        if not stop.is_set():
            with without_garbage_collection():  # figures are many objects
                written, problem = write_pages(recorded, metrics, place, not options.no_replay)
    rows = [(name.removesuffix(".html"), str(place / name)) for name in written] or [("run folder", str(place))]
    print(table([*summary_rows(metrics), *push_rows(recorded), *degraded_rows(recorded), *rows]))
    if problem:
        say(f"pdhocbf: {problem}; `pdhocbf report {place}` makes up what is missing")
    if not stop.is_set():
        complete(recorded.scenario, options.verbose)
    return exit_code(recorded.log.ending, place) or bool(problem)


def _say_fit(scenario: Scenario, fitted: Fitted | None, every: bool) -> None:
    """Says which values were made to fit the robot, or how many."""
    if fitted is not None:
        from pdhocbf_drake.fitting.said import sentences  # here, since it loads Drake

        for sentence in sentences(fitted, scenario.robot, every):
            say(f"pdhocbf: {sentence}")


def _within_limits(scenario: Scenario) -> Scenario:
    """The walk as its robot's joints allow it, which is simulated and written; says what they change, and doubts."""
    if scenario.system != "biped":
        return scenario
    from pdhocbf_drake.fitting.walk_checks import walk_findings
    from pdhocbf_drake.simulation.limits import checked_walk

    biped, kept = checked_walk(scenario)
    for sentence in kept.sentences:
        say(f"pdhocbf: {sentence}")
    box = None if scenario.mpc.recovery is None else scenario.mpc.recovery.zmp_box
    for finding in walk_findings(biped, kept.scenario.gait, box, kept.motion):
        if finding.level != "ok":
            say(f"pdhocbf: {finding.level}: {finding}")
    return kept.scenario


def complete(scenario: Scenario, verbose: bool) -> None:
    """Compiles what this walk may need the next time; the run does not depend on it."""
    if scenario.system == "van_der_pol":
        return
    from pdhocbf_drake.simulation.build import complete_programs
    from pdhocbf_drake.simulation.kept_walk import is_kept

    with suppress(KeyboardInterrupt, PdhocbfError):
        complete_programs(scenario)
        if verbose and not is_kept(scenario):
            say("pdhocbf: programs are not kept")


def exit_code(ending: str, place: Path) -> int:
    """0 for a run that reached its duration; for another one, prints the reason and the folder too."""
    kept = f"what was recorded is in {place}"
    if ending == FINISHED:
        return 0
    if ending == INTERRUPTED:
        say(f"pdhocbf: interrupted; {kept}")
        return 1
    say(f"pdhocbf: the {'robot fell' if ending == FELL else f'simulation {ending}'}; {kept}")
    return _ENDED_EARLY


def _recorded(scenario: Scenario, live: bool, verbose: bool, folder: Path) -> Run:
    """Simulates, and writes meanwhile to the folder what is recorded."""
    with quick_imports():
        from pdhocbf_drake.simulation.kept_walk import is_kept, walk_file
        from pdhocbf_drake.simulation.simulate import simulate

    if verbose and scenario.system != "van_der_pol":
        done = "read from" if is_kept(scenario) else "compiled, for"
        say(f"pdhocbf: programs are {done} {walk_file(scenario) or 'this run alone'}")
    scenario = _within_limits(scenario)
    started = time.perf_counter()
    shown = shown_progress(scenario.name, float(scenario.duration), "s simulated")
    with stop_requests() as stop, shown as progress:

        def report(now: float) -> None:
            progress(now)
            if stop.is_set():  # between two ticks, so that the log ends with a whole row
                raise KeyboardInterrupt

        rows = begin_run(scenario, folder)
        log = _watched(scenario, report, rows) if live else simulate(scenario, report, None, rows)
    return Run.of(scenario, log, time.perf_counter() - started)


def _watched(scenario: Scenario, report: Callable[[float], None], rows: Path) -> RunLog:
    """Simulates no faster than real time, in a scene in the browser."""
    from pdhocbf_drake.driving.scene import live_scene
    from pdhocbf_drake.simulation.simulate import advance, make_diagram

    scene, address = live_scene(scenario)
    say(f"live at {address}")
    return advance(scenario, make_diagram(scenario, form="fused"), report, rows=rows, show=scene.draw)


def write_pages(recorded: Run, metrics: Metrics, folder: Path, with_replay: bool) -> tuple[list[str], str]:
    """Writes replay and report; returns the names of those written, and the reason why one is missing, or "".

    What one of them raises costs that one, a full disk and Ctrl-C all that is not yet there.
    """
    from pdhocbf_drake.analysis.products import replay
    from pdhocbf_drake.analysis.report import write_report

    if len(recorded.log) < 2:
        say("pdhocbf: the run has one row, so there is no replay and no report")
        return [], ""
    say(f"{recorded.scenario.name}: drawing the report{' and the replay' if with_replay else ''}")
    made: dict[str, str | None] = {}
    problem = ""

    def make_replay() -> str:
        return replay(recorded, folder / REPLAY)

    def make_report() -> None:
        write_report(recorded, metrics, folder, made.get(REPLAY))

    for name, make in (((REPLAY, make_replay),) if with_replay else ()) + ((REPORT, make_report),):
        try:
            give_back_memory()  # of the simulation, or of the replay
            made[name] = make()
        except KeyboardInterrupt:
            return [*made], _STOPPED
        except Exception as error:
            problem = problem or f"the run is complete, but {name} can't be written: {_cause(error)}"
            if isinstance(error, OSError) and error.errno == errno.ENOSPC:
                break
    return [*made], problem


def _cause(error: Exception) -> str:
    """The reason, without the path of a page, which the sentence names."""
    return str(error).rpartition(": ")[2] if isinstance(error, RunFolderError) else reason(error)


@contextmanager
def run_place(out: Path | None, scenario: Scenario) -> Iterator[Path]:
    """The place of the run folder: the one given, or one in ./runs that no other command gets, even at the same time.

    It is removed at the end if it is empty.
    """
    if out is not None:
        yield out
        return
    runs = Path("runs")
    with writing(runs):
        runs.mkdir(exist_ok=True)
    stem = f"{scenario.name}-{datetime.now():%Y%m%d-%H%M%S}"
    for number in count(1):
        place = runs / (stem if number == 1 else f"{stem}-{number}")
        with writing(place), suppress(FileExistsError):
            place.mkdir()
            break
    try:
        yield place
    finally:
        with suppress(OSError):
            place.rmdir()
