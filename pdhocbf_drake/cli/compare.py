"""`pdhocbf compare`: the safety margins (5) of two runs and their ratio (6)."""

from __future__ import annotations

import argparse
from pathlib import Path

from pdhocbf_drake.arguments import add_from_time
from pdhocbf_drake.simulation.run_folder import read_run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Two runs, and the start of the compared part."""
    parser.add_argument("first", type=Path, metavar="RUN")
    parser.add_argument("second", type=Path, metavar="RUN")
    add_from_time(parser, "start of the steady state [s]; by default the from_time of the first run's scenario")


def run(options: argparse.Namespace) -> int:
    """Prints the margins and M, eq. (6)."""
    places = options.first, options.second
    runs = read_run(places[0]), read_run(places[1])
    from pdhocbf_drake.analysis.comparison import compare  # here, since it loads Drake, as in `replay`

    start = runs[0].scenario.from_time if options.from_time is None else options.from_time
    for found in compare(*runs, start, (str(places[0]), str(places[1]))):
        for place, one, name, margin in zip(places, runs, found.names, found.margins, strict=True):
            mean = f"mean h {margin:.5g} {found.unit} from {start:g} s on"
            print(f"{place}: {one.scenario.name}, barrier {name}: {mean}")
        print(f"M = {100 * found.ratio:.1f} %: {_meaning(found.ratio)}")
    return 0


def _meaning(ratio: float) -> str:
    if ratio < 0:
        return "the margins have opposite signs: one of the runs left its safe set on average"
    if ratio <= 1:
        return f"the first run's barrier is {100 * (1 - ratio):.1f} % less conservative"
    return f"the first run's barrier is {100 * (ratio - 1):.1f} % more conservative"
