"""`pdhocbf list`: the scenarios that come with the package."""

from __future__ import annotations

import argparse

from pdhocbf_drake.simulation.scenario_file import load_written, scenario_names
from pdhocbf_drake.terminal import table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Takes none."""


def run(options: argparse.Namespace) -> int:
    """Prints each scenario with its description."""
    print(table([(name, load_written(name).scenario.description) for name in scenario_names()]))
    return 0
