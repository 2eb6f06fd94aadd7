"""`pdhocbf limits`: walks at the limits of joints and ground, beside what they must reach."""

from __future__ import annotations

import argparse
from typing import Any

from pdhocbf_drake.arguments import add_scenario, add_work
from pdhocbf_drake.studies.shared.table_command import run_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the rows of the table, and the folder of the results."""
    add_scenario(parser)
    some = "some of the rows, apart by semicolons, such as 'knee_pitch torque 80 %%;joint barriers'"
    parser.add_argument("--rows", metavar="LIST", help=some)
    parser.add_argument("--quick", action="store_true", help="a few seconds of each, without the closed form beside it")
    add_work(parser, "limits")


def run(options: argparse.Namespace) -> int:
    """Walks, writes and prints; returns the exit code."""
    run_table(options, "limits", ";", _study, quick=options.quick)
    return 0


def _study() -> tuple[Any, Any]:
    from pdhocbf_drake.studies.limits.study import limits, plan

    return plan, limits
