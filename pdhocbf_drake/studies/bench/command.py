"""`pdhocbf bench`: measures, prints tables, and writes numbers and plots."""

from __future__ import annotations

import argparse
from pathlib import Path

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.file import replaced_file
from pdhocbf_drake.files.pages import page
from pdhocbf_drake.files.places import check_file
from pdhocbf_drake.terminal import say, shown_progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's arguments."""
    parser.add_argument("--quick", action="store_true", help="a small version, half a minute")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers, and the plots beside them")


def run(options: argparse.Namespace) -> int:
    """Runs the benchmark; returns the exit code."""
    place: Path | None = options.json
    if place is not None and not place.parent.is_dir():
        raise InputError(f"--json: the folder {place.parent} does not exist")
    if place is not None:
        check_file(place)
    # Imported here, since they import Drake: a wrong argument is refused without that delay.
    from pdhocbf_drake.analysis.drawing import save
    from pdhocbf_drake.studies.bench.benchmark import FULL, QUICK, measure
    from pdhocbf_drake.studies.bench.report import draw, report
    from pdhocbf_drake.studies.shared.results import write_json

    effort = QUICK if options.quick else FULL
    with shown_progress("bench", 100, "%") as progress:
        results = measure(effort, lambda share: progress(round(100 * share)))
    results["quick"] = bool(options.quick)
    print(report(results))
    if place is not None:
        write_json(place, results, indent=2)
        with page("the plots"):
            for name, figure in draw(results).items():
                with replaced_file(place.with_name(f"{place.stem}_{name}.png")) as staging:
                    save(figure, staging)
        say(f"numbers in {place}, plots beside it")
    return 0
