"""`pdhocbf list`: the scenarios that come with the package."""

from __future__ import annotations

import argparse

from pdhocbf_drake.simulation.scenario_file import load_scenario, scenario_names


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """There is nothing to choose."""


def run(options: argparse.Namespace) -> int:
    """Prints each scenario with its one sentence."""
    names = scenario_names()
    width = max(len(name) for name in names)
    for name in names:
        print(f"{name:<{width}}  {load_scenario(name).description}")
    return 0
