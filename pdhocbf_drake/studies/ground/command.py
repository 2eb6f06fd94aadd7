"""`pdhocbf ground`: walks over stairs, slopes and blocks, beside what they must reach."""

from __future__ import annotations

import argparse
from typing import Any

from pdhocbf_drake.arguments import add_scenario, add_work
from pdhocbf_drake.studies.shared.table_command import run_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the rows of the table, and the folder of the results."""
    add_scenario(parser)
    parser.add_argument("--rows", metavar="LIST", help="some of the rows, such as 'stairs up 0.05,blocks'")
    parser.add_argument("--quick", action="store_true", help="short ground, and few walks of each kind")
    parser.add_argument("--walks", type=int, default=30, metavar="N", help="over each kind of random ground")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of random ground")
    add_work(parser, "ground")


def run(options: argparse.Namespace) -> int:
    """Walks, writes and prints; returns the exit code."""
    run_table(options, "ground", ",", _study, quick=options.quick, walks=options.walks, seed=options.seed)
    if not options.quick:
        print("the run folders of single walks are beside it")
    return 0


def _study() -> tuple[Any, Any]:
    from pdhocbf_drake.studies.ground.plan import plan
    from pdhocbf_drake.studies.ground.study import ground

    return plan, ground
