"""`pdhocbf directions`: walks that turn, go sideways, stop and start, beside what they must reach."""

from __future__ import annotations

import argparse
from typing import Any

from pdhocbf_drake.arguments import add_scenario, add_work
from pdhocbf_drake.studies.shared.table_command import run_table


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
    run_table(options, "directions", ",", _study, quick=options.quick, walks=options.walks, seed=options.seed)
    if not options.quick:
        print("the run folders of single walks are beside it")
    return 0


def _study() -> tuple[Any, Any]:
    from pdhocbf_drake.studies.directions.plan import plan
    from pdhocbf_drake.studies.directions.study import directions

    return plan, directions
