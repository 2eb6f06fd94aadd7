"""`pdhocbf sensing`: walks with late, noisy and wrong knowledge of the robot, beside what they must reach."""

from __future__ import annotations

import argparse
from pathlib import Path

from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.terminal import shown_progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the rows of the table, and the folder of the results."""
    parser.add_argument("scenario", metavar="SCENARIO", help="a name from `pdhocbf list`, or FILE[:NAME]")
    add_overrides(parser)
    parser.add_argument(
        "--rows", metavar="LIST", help="some of the rows, apart by semicolons, such as 'wind;torso 1.3'"
    )
    parser.add_argument("--quick", action="store_true", help="one seed, a few seconds of each")
    parser.add_argument("--seeds", type=int, default=10, metavar="N", help="seeds 0 to N - 1 of each row")
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="processes")
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/sensing-NAME")


def run(options: argparse.Namespace) -> int:
    """Walks, writes and prints; returns the exit code."""
    scenario = load_scenario(options.scenario, options.text)
    rows = None if options.rows is None else [word.strip() for word in options.rows.split(";") if word.strip()]
    if options.workers < 1:
        raise InputError(f"workers must be 1 or more (given: {options.workers})")
    folder: Path = options.out or Path("runs") / f"sensing-{scenario.name}"
    # Here, since they load Drake: an argument that can't be used is refused at once.
    from pdhocbf_drake.studies.sensing.study import RESULT, plan, sensing
    from pdhocbf_drake.studies.shared.check_table import table

    chosen = {"rows": rows, "seeds": options.seeds, "quick": options.quick}
    with shown_progress("sensing", len(plan(scenario, **chosen)), "walks") as progress:
        checks, notes = sensing(
            scenario, workers=options.workers, out=folder, progress=lambda done: progress(done), **chosen
        )
    print(table(checks, notes), flush=True)
    print(f"wrote {folder / RESULT}")
    return 0
