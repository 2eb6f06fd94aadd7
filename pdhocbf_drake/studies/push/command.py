"""`pdhocbf push`: the largest push that the robot of a scenario survives, by direction, phase and barrier."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from pdhocbf_drake.arguments import add_scenario, add_work
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.push.study import RESULT, push
from pdhocbf_drake.studies.shared.cases import CASES, lent_barriers
from pdhocbf_drake.studies.shared.events import parse_directions, parse_phases
from pdhocbf_drake.terminal import say, shown_progress

if TYPE_CHECKING:
    from pdhocbf_drake.studies.shared.push_search import Impulse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the pushes to try, and the folder of the results."""
    add_scenario(parser)
    directions = "such as +x,+y or forward,left; one that begins with a minus as --directions=-x,+y"
    parser.add_argument("--directions", default="+x,-x,+y,-y", metavar="LIST", help=directions)
    phases = "how many, evenly spread over the gait, or a list of its ticks such as 0,10,20 (or '0,' for one)"
    parser.add_argument("--phases", default="8", metavar="N|LIST", help=phases)
    parser.add_argument("--barriers", default=",".join(CASES), metavar="LIST", help="which of " + ", ".join(CASES))
    parser.add_argument("--tolerance", type=float, default=1.0, metavar="NS", help="resolution of the answer [N s]")
    parser.add_argument("--duration", type=float, default=0.1, metavar="S", help="length of a push [s]")
    parser.add_argument("--watch", type=float, default=3.2, metavar="S", help="time simulated from the push on [s]")
    add_work(parser, "push")


def run(options: argparse.Namespace) -> int:
    """Searches, writes and prints; returns the exit code."""
    scenario = load_scenario(options.scenario, options.text)
    directions = parse_directions(options.directions)
    phases = parse_phases(options.phases, scenario.gait.ticks_per_gait)
    barriers = [word.strip() for word in options.barriers.split(",") if word.strip()]
    folder: Path = options.out or Path("runs") / f"push-{scenario.name}"
    if lent := lent_barriers(scenario):
        say(lent)
    with shown_progress("push", len(barriers) * len(directions) * len(phases), "searches") as progress:
        push(
            scenario, directions=directions, phases=phases, barriers=barriers, tolerance=options.tolerance,
            duration=options.duration, watch=options.watch, workers=options.workers, out=folder, progress=progress,
            found=_print,
        )  # fmt: skip
    print(f"wrote {folder / RESULT} and two figures beside it")
    return 0


def _print(impulses: list[Impulse]) -> None:
    from pdhocbf_drake.studies.push.results import table  # here, since it loads matplotlib, for a quick start

    print(table(impulses), flush=True)
