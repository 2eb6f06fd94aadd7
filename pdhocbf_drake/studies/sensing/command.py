"""`pdhocbf sensing`: walks with late, noisy and wrong knowledge of the robot, beside what they must reach."""

from __future__ import annotations

import argparse
from typing import Any

from pdhocbf_drake.arguments import add_scenario, add_work
from pdhocbf_drake.studies.shared.table_command import run_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the rows of the table, and the folder of the results."""
    add_scenario(parser)
    some = "some of the rows, apart by semicolons, such as 'wind;torso 1.3'"
    parser.add_argument("--rows", metavar="LIST", help=some)
    parser.add_argument("--quick", action="store_true", help="one seed, a few seconds of each")
    parser.add_argument("--seeds", type=int, default=10, metavar="N", help="seeds 0 to N - 1 of each row")
    add_work(parser, "sensing")


def run(options: argparse.Namespace) -> int:
    """Walks, writes and prints; returns the exit code."""
    run_table(options, "sensing", ";", _study, seeds=options.seeds, quick=options.quick)
    return 0


def _study() -> tuple[Any, Any]:
    from pdhocbf_drake.studies.sensing.study import plan, sensing

    return plan, sensing
