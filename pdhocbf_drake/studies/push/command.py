"""`pdhocbf push`: the largest push that the robot of a scenario survives, by direction, phase and barrier."""

from __future__ import annotations

import argparse
from pathlib import Path

from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.run_folder import replaced_file
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.push.results import document, draw_phases, draw_polar, table
from pdhocbf_drake.studies.push.search import Settings, search_all
from pdhocbf_drake.studies.shared.cases import CASES, lent_barriers
from pdhocbf_drake.studies.shared.events import parse_directions, parse_phases
from pdhocbf_drake.studies.shared.results import result_folder, write_json, write_text
from pdhocbf_drake.terminal import say, shown_progress

RESULT = "push.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the pushes to try, and the folder of the results."""
    parser.add_argument("scenario", metavar="SCENARIO", help="a name from `pdhocbf list`, or FILE[:NAME]")
    add_overrides(parser)
    directions = "such as +x,+y or forward,left; one that begins with a minus as --directions=-x,+y"
    parser.add_argument("--directions", default="+x,-x,+y,-y", metavar="LIST", help=directions)
    phases = "how many, evenly spread over the gait, or a list of its ticks such as 0,10,20 (or '0,' for one)"
    parser.add_argument("--phases", default="8", metavar="N|LIST", help=phases)
    parser.add_argument("--barriers", default=",".join(CASES), metavar="LIST", help="which of " + ", ".join(CASES))
    parser.add_argument("--tolerance", type=float, default=1.0, metavar="NS", help="resolution of the answer [N s]")
    parser.add_argument("--duration", type=float, default=0.1, metavar="S", help="length of a push [s]")
    parser.add_argument("--watch", type=float, default=3.2, metavar="S", help="time simulated from the push on [s]")
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="processes")
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/push-NAME")


def run(options: argparse.Namespace) -> int:
    """Searches, writes and prints; returns the exit code."""
    scenario = load_scenario(options.scenario, options.text)
    directions = parse_directions(options.directions)
    gait = scenario.gait
    phases = parse_phases(options.phases, gait.ticks_per_gait)
    barriers = [word.strip() for word in options.barriers.split(",") if word.strip()]
    settings = _settings(options, gait.ticks_per_gait * gait.tick)
    if not barriers or not set(barriers) <= set(CASES):
        raise InputError(f"--barriers: a list of {', '.join(CASES)} is needed (given: {options.barriers!r})")
    if options.workers < 1:
        raise InputError(f"--workers must be 1 or more (given: {options.workers})")
    if scenario.system != "biped":
        raise InputError(f"scenario.system: only a 'biped' can be pushed here (given: {scenario.system!r})")
    folder = result_folder(options.out, "push", scenario)
    if lent := lent_barriers(scenario):
        say(lent)
    mass = Biped.load(scenario.robot).mass
    total = len(barriers) * len(directions) * len(phases)
    with shown_progress("push", total, "searches") as progress:
        impulses = search_all(scenario, barriers, directions, phases, settings, options.workers, mass, progress)
    print(table(impulses), flush=True)  # before the files, since a full disk must not cost the result
    with replaced_file(folder / "push.png") as staging:
        draw_polar(impulses, staging)
    with replaced_file(folder / "push_phases.png") as staging:
        draw_phases(impulses, staging, gait.ticks_per_step)
    write_text(folder / "push.txt", table(impulses))
    write_json(folder / RESULT, document(impulses))
    print(f"wrote {folder / RESULT} and two figures beside it")
    return 0


def _settings(options: argparse.Namespace, gait: float) -> Settings:
    """The settings that the searches share; raises `InputError`."""
    for name, least in (("tolerance", 0.01), ("duration", 0.01), ("watch", options.duration + gait)):
        value = getattr(options, name)
        if not least <= value < 1e3:
            raise InputError(f"--{name} must be at least {least:g} (given: {value:g})")
    return Settings(options.tolerance, options.duration, options.watch)
