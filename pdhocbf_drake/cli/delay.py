"""`pdhocbf delay`: how late the measurements of a recorded walk are, and how its ZMP lags."""

from __future__ import annotations

import argparse
from pathlib import Path

from pdhocbf_drake.simulation.run_folder import read_run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One run."""
    parser.add_argument("run", type=Path, metavar="RUN")


def run(options: argparse.Namespace) -> int:
    """Prints delay and lag, how sure they are, and the keys that say so in a scenario."""
    recorded = read_run(options.run)
    from pdhocbf_drake.analysis.late import late  # here, since it loads Drake, as in `replay`

    found, tick = late(recorded), recorded.scenario.gait.tick
    spreads = 1e3 * found.spreads
    near = [d for d in (found.delay - 1, found.delay, found.delay + 1) if 0 <= d < len(spreads)]
    votes = f"{found.agree} of {found.gaits} gaits say so"
    print(f"measured {found.delay} ticks late ({1e3 * tick * found.delay:g} ms): {votes}")
    print("spread of the velocity's error: " + ", ".join(f"{spreads[d]:.3g} mm/s at {d}" for d in near))
    lag = "no lag of the ZMP" if found.zmp_lag is None else f"the ZMP lags at {found.zmp_lag:g} 1/s"
    print(lag)
    print(f"mpc: {{delay: {found.delay}, zmp_lag: {'null' if found.zmp_lag is None else f'{found.zmp_lag:g}'}}}")
    return 0
