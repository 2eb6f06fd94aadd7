"""`pdhocbf certify`: whether bounds can be kept for ever, at which phase they fail, their cost, the largest push."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.terminal_set import TerminalSet, limits_of, save_terminal_sets
from pdhocbf_drake.sets.user_system import LinearSystemConfig
from pdhocbf_drake.simulation.run_folder import FIGURES, SCENARIO, new_run_folder
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.certify.certificate import STAGES, certify_scenario
from pdhocbf_drake.studies.certify.report import certificate_data, certificate_lines, system_data
from pdhocbf_drake.studies.certify.terminal import terminal_sets
from pdhocbf_drake.studies.certify.trial import try_sets
from pdhocbf_drake.studies.shared.results import write_json
from pdhocbf_drake.terminal import shown_progress, table
from pdhocbf_drake.yaml_text import read_yaml, write_yaml

CERTIFICATE, TERMINAL = "certify.json", "terminal_set.npz"
_ENTRIES = {CERTIFICATE, TERMINAL, SCENARIO, FIGURES}


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
        help="try the sets: walk 400 ticks from N random starts inside, prove N random starts outside lost",
    )  # fmt: skip
    parser.add_argument("--no-rows", action="store_true", help="leave out the psi rows, the slowest part")


def run(options: argparse.Namespace) -> int:
    """Certifies, writes and prints; returns the exit code, 0 for a bound that is not enforceable too."""
    if options.reach is not None and not 0.0 < options.reach < 10.0:
        raise InputError(f"--reach must be a length above 0 [m], given {options.reach}")
    if options.starts < 0:
        raise InputError(f"--starts must be 0 or more, given {options.starts}")
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
    return LinearSystemConfig.from_dict({"name": path.stem, **data}, path.stem)


def _certify_system(config: LinearSystemConfig, options: argparse.Namespace) -> int:
    if options.text or options.starts:
        raise InputError(f"{options.scenario} is a system of its own: --text and --starts are for walks")
    started = time.perf_counter()
    place = options.out or Path("runs") / f"certify-{config.name}"
    with new_run_folder(place, _ENTRIES) as folder:
        data = system_data(config, config.certify(), time.perf_counter() - started)
        write_json(folder / CERTIFICATE, data)
    if data["enforceable"]:
        areas = [phase["area"] for phase in data["phases"]]
        verdict = f"enforceable, found in {data['sweeps']} sweeps; volume {min(areas):.4g} to {max(areas):.4g}"
    else:
        verdict = f"not enforceable: going backward, no state is left at phase {data['first_failing_phase']}"
    print(table([(config.name, verdict), ("certificate", place / CERTIFICATE)]))
    return 0


def _certify_walk(options: argparse.Namespace) -> int:
    from pdhocbf_drake.studies.certify.figures import write_certificate_figures  # here for start-up time

    started = time.perf_counter()
    scenario = load_scenario(options.scenario, options.text)
    place = options.out or Path("runs") / f"certify-{scenario.name}"
    with new_run_folder(place, _ENTRIES) as folder, shown_progress("certify", STAGES + 1, "stages") as progress:
        found = certify_scenario(scenario, options.reach, not options.no_rows, progress)
        seconds = time.perf_counter() - started
        progress(STAGES, "pushes")
        sets: dict[int, TerminalSet] = {}
        try:
            sets, problem = terminal_sets(found), ""
        except InputError as error:
            problem = str(error)
        trial = None
        if options.starts and sets:
            with shown_progress("trial", 2 * options.starts, "starts") as done:
                trial = try_sets(found, options.starts, scenario.seed, done)
        data = certificate_data(found, seconds, trial)
        progress(STAGES + 1)
        write_json(folder / CERTIFICATE, data)
        write_yaml(scenario.to_dict(), folder / SCENARIO)
        lines = certificate_lines(data)
        if sets:
            made_for = limits_of(scenario.gait, scenario.mpc, scenario.barriers)
            save_terminal_sets(folder / TERMINAL, sets, made_for)
            lines.append(("terminal set", f"{place / TERMINAL} (mpc: {{terminal_set: FILE}})"))
        else:
            lines.append(("terminal set", f"none: {problem}"))
        write_certificate_figures(found, data, folder / FIGURES)
    if trial is not None:
        walks = f"{trial.inside} starts of {trial.ticks} ticks: {trial.infeasible_ticks} infeasible ticks"
        lost = f"{trial.unsavable} of {trial.outside} starts proved lost by an independent program"
        lines += [("trial, inside", f"{walks}, largest slack {trial.slack_max:.2g} m/s"), ("trial, outside", lost)]
    print(table([*lines, ("certificate", place / CERTIFICATE), ("figures", place / FIGURES)]))
    return 0
