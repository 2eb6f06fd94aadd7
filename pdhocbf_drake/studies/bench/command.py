"""`pdhocbf bench`: measures, prints tables, and writes numbers and plots where it is told to."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tqdm import tqdm

from pdhocbf_drake.errors import InputError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How much to measure, and where the numbers go."""
    parser.add_argument("--quick", action="store_true", help="a small version, half a minute")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers, and the plots beside them")


def run(options: argparse.Namespace) -> int:
    """Runs the benchmark; gives the exit code."""
    place: Path | None = options.json
    if place is not None and not place.parent.is_dir():
        raise InputError(f"--json: the folder {place.parent} does not exist")
    if place is not None and not os.access(place.parent, os.W_OK):
        raise InputError(f"--json: nothing can be written in the folder {place.parent}")
    from pdhocbf_drake.simulation.run_folder import replaced_file
    from pdhocbf_drake.studies.bench.benchmark import FULL, QUICK, measure
    from pdhocbf_drake.studies.bench.plots import draw
    from pdhocbf_drake.studies.bench.tables import report

    effort = QUICK if options.quick else FULL
    with _progress() as tell:
        results = measure(effort, tell)
    results["quick"] = bool(options.quick)
    print(report(results))
    if place is not None:
        with replaced_file(place) as staging:
            staging.write_text(json.dumps(_plain(results), indent=2) + "\n")
        for name, figure in draw(results).items():
            with replaced_file(place.with_name(f"{place.stem}_{name}.png")) as staging:
                figure.savefig(staging, format="png")
        print(f"numbers in {place}, plots beside it", file=sys.stderr)
    return 0


@contextmanager
def _progress() -> Iterator[Callable[[float], None]]:
    """A bar on a terminal, a line at every tenth otherwise; called with the share that is done."""
    with tqdm(total=100, desc="bench", unit="%", file=sys.stderr, disable=not sys.stderr.isatty()) as bar:
        told = 0

        def tell(share: float) -> None:
            nonlocal told
            bar.update(max(0, round(100 * share) - bar.n))
            if bar.disable and share >= 0.1 * (told + 1):
                told = int(10 * share)
                print(f"bench: {100 * share:.0f} %", file=sys.stderr, flush=True)

        yield tell


def _plain(data: Any) -> Any:
    """JSON has no NaN."""
    if isinstance(data, dict):
        return {key: _plain(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_plain(value) for value in data]
    return None if isinstance(data, float) and data != data else data
