"""`pdhocbf robust`: what robustness to a bounded disturbance costs in margin and speed, and what it buys."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.shared.results import write_json
from pdhocbf_drake.terminal import shown_progress, table

if TYPE_CHECKING:
    from pdhocbf_drake.studies.certify.robust_study import Outcome

RESULTS, KIND = "robust.json", "a folder of robust"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario, the disturbance, its multiples, and the folder of the results."""
    parser.add_argument("scenario", metavar="SCENARIO", help="as for run: a straight walk with one barrier")
    add_overrides(parser)
    parser.add_argument(
        "--disturbance", type=float, nargs=2, required=True, metavar=("C", "V"),
        help="the most that a tick may add to the CoM [m] and to its velocity [m/s], along x and y",
    )  # fmt: skip
    parser.add_argument(
        "--multiples",
        type=float,
        nargs="+",
        default=[0.0, 0.5, 1.0, 2.0],
        metavar="M",
        help="of it; otherwise 0 0.5 1 2",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/robust-NAME")


def run(options: argparse.Namespace) -> int:
    """Walks, writes and prints; returns the exit code."""
    scenario = load_scenario(options.scenario, options.text)
    from pdhocbf_drake.studies.certify.robust_study import CONTROLLERS, outcome_data, robust_study  # loads Drake

    place: Path = options.out or Path("runs") / f"robust-{scenario.name}"
    cases = len(CONTROLLERS) * len(options.multiples)
    with new_folder(place, {RESULTS}, KIND) as folder, shown_progress("robust", cases, "cases") as progress:
        outcomes = robust_study(scenario, tuple(options.disturbance), options.multiples, progress)
        data = {"schema": 1, "scenario": scenario.name, "disturbance": options.disturbance}
        write_json(folder.path / RESULTS, {**data, "outcomes": outcome_data(outcomes)})
    lines = [(f"{one.multiple:g} x {one.controller}", _line(one)) for one in outcomes]
    print(table([*lines, ("results", place / RESULTS)]))
    return 0


def _line(one: Outcome) -> str:
    at_random, at_corners = (f"{1e3 * h:.2f}e-3" if h < float("inf") else "none" for h in (one.h_random, one.h_corners))
    walks = f"h < 0 in {100 * one.below:.1f} % of a walk, {one.fell[0]} of {one.fell[1]} fell"
    least = f"least h {at_random} at random corners, {at_corners} at constant ones"
    return f"bound {1e3 * one.nearer:.2f}e-3 nearer, {one.speed:.4f} m/s; {least}; {walks}"
