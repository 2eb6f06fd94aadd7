"""`pdhocbf replay`: a run's replay, rebuilt from its log."""

from __future__ import annotations

import argparse
from pathlib import Path

from pdhocbf_drake.simulation.run_folder import REPLAY, read_run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One run."""
    parser.add_argument("run", type=Path, metavar="RUN")


def run(options: argparse.Namespace) -> int:
    """Writes the replay again and prints its path."""
    recorded = read_run(options.run)
    from pdhocbf_drake.analysis.products import replay  # here, since it loads Drake: what is no run is refused at once

    replay(recorded, options.run / REPLAY)
    print(options.run / REPLAY)
    return 0
