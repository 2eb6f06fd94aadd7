"""`pdhocbf gait`: joint torques, ZMP, barrier, pushes and certified area over the parameters of a gait."""

from __future__ import annotations

import argparse
from pathlib import Path

from pdhocbf_drake.arguments import add_scenario, add_work
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.gait.plan import default_lines, plan
from pdhocbf_drake.studies.shared.events import parse_directions, parse_phases
from pdhocbf_drake.studies.shared.gait_variants import KEYS
from pdhocbf_drake.studies.shared.pool import check_workers
from pdhocbf_drake.terminal import shown_progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the values to try, and the folder of the results."""
    add_scenario(parser)
    keys = ", ".join(KEYS)
    line = f"values of one of {keys}, all else unchanged; may be repeated; otherwise some of each"
    parser.add_argument("--vary", action="append", metavar="KEY=LIST", help=line)
    over = "as --vary, for a map: every combination of the keys given so is measured"
    parser.add_argument("--over", action="append", metavar="KEY=LIST", help=over)
    pushes = "push the robot too, in directions such as +x,+y (takes minutes)"
    parser.add_argument("--directions", metavar="LIST", help=pushes)
    phases = "ticks of the gait at which pushes begin, as for push"
    parser.add_argument("--phases", default="4", metavar="N|LIST", help=phases)
    add_work(parser, "gait")


def run(options: argparse.Namespace) -> int:
    """Measures, writes and prints; returns the exit code."""
    scenario = load_scenario(options.scenario, options.text)
    over = _values("--over", options.over or [])
    lines = _values("--vary", options.vary or [])
    if not lines and not over:
        lines = default_lines(scenario)
    directions = parse_directions(options.directions) if options.directions else []
    phases = parse_phases(options.phases, scenario.gait.ticks_per_gait)
    check_workers(options.workers)
    total = len(plan(scenario, lines, over, directions, phases))
    folder: Path = options.out or Path("runs") / f"gait-{scenario.name}"
    # Here, since they load Drake: an argument that can't be used is refused at once.
    from pdhocbf_drake.studies.gait.study import RESULT, gait_study
    from pdhocbf_drake.studies.shared.gait_table import table

    with shown_progress("gait", total, "gaits") as progress:
        gaits = gait_study(
            scenario, lines=lines, over=over, directions=directions, phases=phases, workers=options.workers,
            out=folder, progress=lambda done: progress(done),
        )  # fmt: skip
    print(table(gaits), flush=True)
    print(f"wrote {folder / RESULT} and its figures")
    return 0


def _values(option: str, given: list[str]) -> dict[str, list[float]]:
    """Keys and their values from texts such as "com_height=0.55,0.58"; raises `InputError`."""
    found: dict[str, list[float]] = {}
    for text in given:
        key, _, values = text.partition("=")
        try:
            numbers = [float(value) for value in values.split(",") if value.strip()]
        except ValueError:
            numbers = []
        if key not in KEYS or not numbers:
            raise InputError(
                f"{option}: KEY=LIST with one of {', '.join(KEYS)} and numbers is needed (given: {text!r})"
            )
        found[key] = [round(n) if "ticks" in key or "phase" in key else n for n in numbers]
    return found
