"""`pdhocbf certify`: whether bounds can be kept for ever, at which phase they fail, their cost, the largest push."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.simulation.run_folder import FIGURES
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.certify.study import CERTIFICATE, ENTRIES, KIND, STAGES, TERMINAL, certify
from pdhocbf_drake.studies.shared.results import write_json
from pdhocbf_drake.terminal import shown_progress, table
from pdhocbf_drake.yaml_text import read_yaml

if TYPE_CHECKING:
    from pdhocbf_drake.sets.user_system import LinearSystemConfig


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A scenario or system, the reach, the trial, and the folder of the results."""
    parser.add_argument(
        "scenario", metavar="SCENARIO",
        help="as for run; or a YAML file of another periodic linear system with A, B, states and inputs",
    )  # fmt: skip
    add_overrides(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder; otherwise ./runs/certify-NAME")
    parser.add_argument(
        "--reach", type=float, metavar="M",
        help="how far the CoM may be from the stance foot [m]; otherwise half the robot's longest stride",
    )  # fmt: skip
    parser.add_argument(
        "--starts", type=int, default=0, metavar="N",
        help="try the sets: walk from N random starts inside, under random, constant and worst disturbances in turn if "
        "there is one; or else prove N random starts outside lost too",
    )  # fmt: skip
    parser.add_argument("--ticks", type=int, default=400, metavar="T", help="of each such walk; otherwise 400")
    parser.add_argument(
        "--disturbance", type=float, nargs="*", metavar="D",
        help="what the sets are to withstand at every tick, the half-width of each state's disturbance: for a walk two "
        "numbers, of the CoM [m] and of its velocity [m/s], the same along x and y; without numbers that of the "
        "scenario's mpc.robust. The largest multiple of it that leaves a set is found too",
    )  # fmt: skip
    parser.add_argument("--no-rows", action="store_true", help="leave out the psi rows, the slowest part")


def run(options: argparse.Namespace) -> int:
    """Certifies, writes and prints; returns the exit code, 0 for a bound that is not enforceable too."""
    system = _linear_system(options.scenario)
    return _certify_walk(options) if system is None else _certify_system(system, options)


def _linear_system(scenario: str) -> LinearSystemConfig | None:
    """The linear system in a file; None if the file holds a scenario."""
    path = Path(scenario)
    if path.suffix not in (".yaml", ".yml"):
        return None
    data = read_yaml(path)
    if not (isinstance(data, dict) and {"A", "B"} & set(data)):
        return None
    from pdhocbf_drake.sets.user_system import LinearSystemConfig  # here, since it loads scipy, for a quick start

    return LinearSystemConfig.from_dict({"name": path.stem, **data}, path.stem)


def _certify_system(config: LinearSystemConfig, options: argparse.Namespace) -> int:
    if options.text or options.starts:
        raise InputError(f"{options.scenario} is a system of its own: --text and --starts are for walks")
    import numpy as np

    from pdhocbf_drake.studies.certify.disturbance_report import disturbance_lines
    from pdhocbf_drake.studies.certify.report import system_data  # here, since it loads Drake

    if options.disturbance is not None:
        config = config.disturbed_by(options.disturbance)
    started = time.perf_counter()
    place = options.out or Path("runs") / f"certify-{config.name}"
    with new_folder(place, ENTRIES, KIND) as folder:
        found = config.certify()
        largest = config.largest(found) if any(map(np.any, config.disturbances())) else None
        data = system_data(config, found, time.perf_counter() - started, largest)
        write_json(folder.path / CERTIFICATE, data)
    if data["enforceable"]:
        areas, free = ([phase[key] for phase in data["phases"]] for key in ("area", "free"))
        verdict = f"enforceable, found in {data['sweeps']} sweeps; volume {min(areas):.4g} to {max(areas):.4g}"
        least, states = min(map(len, free)), len(data["phases"][0]["vertices"][0])
        verdict += f"; flat, of {least} instead of {states} dimensions" if least < states else ""
    else:
        failed = f"going backward, no set with an interior is left at phase {data['first_failing_phase']}"
        verdict = f"not enforceable: {config.lost_state() or failed}"
    print(table([(config.name, verdict), *disturbance_lines(data), ("certificate", place / CERTIFICATE)]))
    return 0


def _certify_walk(options: argparse.Namespace) -> int:
    scenario = load_scenario(options.scenario, options.text)
    disturbance = options.disturbance
    if disturbance is not None and not disturbance:
        if scenario.mpc.robust is None:
            raise InputError(f"scenario '{scenario.name}': --disturbance takes half-widths, or those of mpc.robust")
        disturbance = scenario.mpc.robust
    place: Path = options.out or Path("runs") / f"certify-{scenario.name}"
    with shown_progress("certify", STAGES, "stages") as progress:
        data = certify(
            scenario, reach=options.reach, rows=not options.no_rows, starts=options.starts,
            ticks=options.ticks, disturbance=disturbance, out=place, progress=progress,
        )  # fmt: skip
    from pdhocbf_drake.studies.certify.report import certificate_lines  # here, since it loads Drake

    lines, problem = certificate_lines(data), data["terminal_set_problem"]
    usable = f"{place / TERMINAL} (mpc: {{terminal_set: FILE}})"
    lines.append(("terminal set", f"none: {problem}" if problem else usable))
    if data["trial"] is not None:
        lines += _trial_lines(data["trial"])
    print(table([*lines, ("certificate", place / CERTIFICATE), ("figures", place / FIGURES)]))
    return 0


def _trial_lines(trial: dict[str, Any]) -> list[tuple[str, str]]:
    h = "" if trial["h_min"] is None else f", least h {trial['h_min']:.2g} m/s"
    ticks = f"{trial['inside']} starts of {trial['ticks']} ticks"
    slack = f"largest slack {trial['slack_max']:.2g} m/s"
    inside = ("trial, inside", f"{ticks}: {trial['infeasible_ticks']} infeasible ticks{h}, {slack}")
    if not trial["outside"]:
        return [inside]
    lost = f"{trial['unsavable']} of {trial['outside']} starts proved lost by an independent program"
    least = f"least excess over a limit {1e3 * trial['excess_min']:.2g} mm or mm/s"
    return [inside, ("trial, outside", f"{lost}, {least}")]
