"""`pdhocbf directions`: walks that turn, go sideways, stop and start, beside what they must reach."""

from __future__ import annotations

import argparse
from pathlib import Path

from pdhocbf_drake.arguments import add_scenario, add_work
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.terminal import shown_progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the rows of the table, and the folder of the results."""
    add_scenario(parser)
    parser.add_argument("--rows", metavar="LIST", help="some of the rows, such as circle,square,random")
    parser.add_argument("--quick", action="store_true", help="a few seconds of each, without pushes")
    parser.add_argument("--walks", type=int, default=20, metavar="N", help="random sequences of commands")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the random sequences")
    add_work(parser, "directions")


def run(options: argparse.Namespace) -> int:
    """Walks, writes and prints; returns the exit code."""
    scenario = load_scenario(options.scenario, options.text)
    rows = None if options.rows is None else [word.strip() for word in options.rows.split(",") if word.strip()]
    if options.workers < 1:
        raise InputError(f"workers must be 1 or more (given: {options.workers})")
    folder: Path = options.out or Path("runs") / f"directions-{scenario.name}"
    # Here, since they load Drake: an argument that can't be used is refused at once.
    from pdhocbf_drake.studies.directions.plan import plan
    from pdhocbf_drake.studies.directions.study import RESULT, directions
    from pdhocbf_drake.studies.shared.check_table import table

    chosen = {"rows": rows, "quick": options.quick, "walks": options.walks, "seed": options.seed}
    with shown_progress("directions", len(plan(scenario, **chosen)), "pieces") as progress:
        checks, notes = directions(
            scenario, workers=options.workers, out=folder, progress=lambda done: progress(done), **chosen
        )
    print(table(checks, notes), flush=True)
    print(f"wrote {folder / RESULT}, and run folders beside it" if not options.quick else f"wrote {folder / RESULT}")
    return 0
