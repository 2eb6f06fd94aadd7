"""`pdhocbf drive`: a walk in real time under the controls of its scene in a browser, recorded as a run."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.cli.run import complete, exit_code, run_place, write_pages
from pdhocbf_drake.collecting import quick_imports
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.run_folder import ENTRIES, ROWS, Run, begin_run
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.stopping import interruptible, stop_requests
from pdhocbf_drake.terminal import say, shown_progress, table

if TYPE_CHECKING:
    from pdhocbf_drake.driving.session import Driven

_HOW = (
    'W S forward, A D sideways, Q E turn, Space stand or walk, P pause, R restart; "Open Controls" at the upper right '
    'of the page shows h and all controls; Ctrl-C or the button "end" ends it and writes the run'
)
_LATE = 0.05  # share of late ticks from which on it is said that real time isn't kept


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, its overrides, the run folder, and a driver that is a file."""
    own = "its own commands, pushes and barrier_changes give way to the driver's"
    text = f"a walk from `pdhocbf list`, or a YAML file (default: walking); {own}"
    parser.add_argument("scenario", metavar="SCENARIO", nargs="?", default="walking", help=text)
    add_overrides(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="the run folder; otherwise a new one in ./runs")
    parser.add_argument("--seconds", type=float, metavar="S", help="ends by itself after so much walking")
    parser.add_argument(
        "--script", type=Path, metavar="FILE", help="presses that a YAML file lists, in place of a hand"
    )
    parser.add_argument(
        "--headless", action="store_true", help="no scene, and no waiting for real time; needs --script"
    )
    parser.add_argument("--no-replay", action="store_true", help="leave replay.html out")


def run(options: argparse.Namespace) -> int:
    """Drives, writes the run folder, prints the summary and returns the exit code."""
    if options.headless and options.script is None:
        raise InputError("--headless: a drive without a scene needs a --script")
    if options.seconds is not None and not options.seconds > 0.0:
        raise InputError(f"--seconds: must be above 0 (given: {options.seconds:g})")
    scenario = load_scenario(options.scenario, options.text)
    check_scenario(scenario)
    with interruptible(), run_place(options.out, scenario) as place, new_folder(place, ENTRIES, keep=ROWS) as folder:
        for saved in folder.saved:
            say(f"pdhocbf: a run was killed as it was written to {place}; what it recorded is now in {saved}")
        started = time.perf_counter()
        with stop_requests() as stop:
            driven = _driven(options, scenario, begin_run(scenario, folder.path), stop.is_set)
            with quick_imports():
                from pdhocbf_drake.analysis.pushes import push_rows
                from pdhocbf_drake.analysis.report import metrics_of
                from pdhocbf_drake.analysis.summary import summary_rows
                from pdhocbf_drake.files.file import write_text
                from pdhocbf_drake.simulation.run_folder import METRICS

            recorded = Run.of(driven.scenario, driven.log, time.perf_counter() - started)
            recorded.save(folder.path)
            metrics = metrics_of(recorded).model_copy(update={"late_ticks": driven.late_ticks})
            write_text(folder.path / METRICS, metrics.to_json())
            folder.finish()
        written, problem = write_pages(recorded, metrics, place, not options.no_replay)
    rows = [(name.removesuffix(".html"), str(place / name)) for name in written] or [("run folder", str(place))]
    share = driven.late_ticks
    late = [] if share is None else [("real time", f"{100 * share:.1f} % of the ticks were late")]
    print(table([*summary_rows(metrics), *push_rows(recorded), *late, *rows]))
    if share is not None and share > _LATE:
        say(f"pdhocbf: real time was not kept: {late[0][1]}; the walk itself is as it would be on time")
    if problem:
        say(f"pdhocbf: {problem}; `pdhocbf report {place}` makes up what is missing")
    complete(driven.scenario, verbose=False)
    return exit_code(driven.log.ending, place) or bool(problem)


def _driven(options: argparse.Namespace, scenario: Scenario, rows: Path, stopped: Callable[[], bool]) -> Driven:
    """Drives by hand or by a file."""
    with quick_imports():
        from pdhocbf_drake.driving.script import Script
        from pdhocbf_drake.driving.session import LONGEST, Session

    script = None if options.script is None else Script.read(options.script)
    seconds = options.seconds or LONGEST
    if script is not None and (late := script.after(seconds)):
        say(f"pdhocbf: the drive ends at {seconds:g} s, before {', '.join(late)}")
    if options.headless:
        assert script is not None
        with shown_progress(scenario.name, float(seconds), "s simulated") as progress:
            session = Session(scenario, script.at, pace=False, rows=rows)
            session.check(script.barriers())
            return session.run(seconds, stopped, progress)
    from pdhocbf_drake.analysis.replay_stage import Stage
    from pdhocbf_drake.driving.panel import Panel, strongest_push
    from pdhocbf_drake.driving.scene import LiveScene

    stage = Stage(None)
    scene, panel = LiveScene(stage, scenario), Panel(stage.meshcat, scenario, strongest_push(scenario))
    ask = script.at if script is not None else lambda now: panel.read()
    session = Session(scenario, ask, scene.draw, rows=rows)
    if script is not None:
        session.check(script.barriers())
    say(f"drive it at {stage.meshcat.web_url()}; {_HOW}")
    return session.run(seconds, stopped)
