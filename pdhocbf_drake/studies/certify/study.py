"""The study of certified sets as a function: whether bounds can be kept for ever, their cost, and the largest push."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.files.pages import page
from pdhocbf_drake.mpc.config import RobustConfig
from pdhocbf_drake.mpc.terminal_set import TerminalSet, limits_of, save_terminal_sets
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.run_folder import FIGURES, SCENARIO
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.results import write_json
from pdhocbf_drake.yaml_text import write_yaml

if TYPE_CHECKING:  # these load Drake, and are loaded once the arguments have been checked
    from pdhocbf_drake.studies.certify.scenario_certificate import ScenarioCertificate
    from pdhocbf_drake.studies.certify.trial import Trial

STAGES: Final = 4  # those of `certify_scenario`, and the pushes
CERTIFICATE, TERMINAL = "certify.json", "terminal_set.npz"
ENTRIES = {CERTIFICATE, TERMINAL, SCENARIO, FIGURES}
KIND = "a folder of certify"

Report = Callable[[int, str], None]


def certify(
    scenario: Scenario,
    *,
    reach: float | None = None,
    rows: bool = True,
    starts: int = 0,
    ticks: int = 400,
    disturbance: Sequence[float] | Mapping[str, Any] | RobustConfig | None = None,
    out: str | Path | None = None,
    progress: Report = lambda done, stage: None,
) -> dict[str, Any]:
    """The largest sets in which a scenario's walk can be kept for ever under its bounds, as `pdhocbf certify` does.

    Args:
        scenario: a walk, on the robot or on the template.
        reach: of the CoM from the stance foot [m]; by default half the longest stride of the robot.
        rows: certify the ψ rows of each barrier as well, which takes the longest.
        starts: try the sets: walk from that many random starts inside, and without a disturbance prove as many outside
            lost.
        ticks: length of each such walk.
        disturbance: half-widths of what a tick may add to the CoM and to its velocity, along x and y [m, m/s];
            {"x": [...], "y": [...]}, as `mpc.robust.disturbance`; or all of `mpc.robust`. The sets then withstand it
            for ever, and the largest multiple of it that leaves any is computed.
        out: a folder for certify.json, terminal_set.npz, the scenario and figures.
        progress: called with the number of stages that are done, of four, and the name of the next one.

    Returns:
        The content of certify.json, see docs/certified_sets.md. That a bound can't be kept is an answer:
        `enforceable` is then False.

    Raises:
        InputError: the scenario is no walk, or can't be built or certified, or an argument can't be used.
        ModelError: its robot can't be loaded. RunFolderError: `out` can't be written.
        Warns of figures that can't be drawn (`PageWarning`).
    """
    if reach is not None and not 0.0 < reach < 10.0:
        raise InputError(f"reach must be a length above 0 [m], given {reach}")
    if starts < 0:
        raise InputError(f"starts must be 0 or more, given {starts}")
    if ticks < 1:
        raise InputError(f"ticks must be 1 or more, given {ticks}")
    check_straight(scenario)
    robust = None if disturbance is None else _robust(disturbance)
    if scenario.system == "van_der_pol":
        raise InputError(
            f"scenario '{scenario.name}' is no walk; another system is certified from a file with A, B and limits"
        )
    # Here and below, since they load Drake: what can't be certified is refused at once.
    from pdhocbf_drake.studies.certify.report import certificate_data
    from pdhocbf_drake.studies.certify.scenario_certificate import certify_scenario

    started = time.perf_counter()
    with nullcontext() if out is None else new_folder(Path(out), ENTRIES, KIND) as folder:
        found = certify_scenario(scenario, reach, rows, progress, robust)
        seconds = time.perf_counter() - started
        progress(STAGES - 1, "pushes")
        sets, problem = _terminal(found)
        trial = _trial(found, starts, ticks, progress) if starts and sets else None
        data = {**certificate_data(found, seconds, trial), "terminal_set_problem": problem}
        progress(STAGES, "")
        if folder is not None and out is not None:
            _write(folder.path, scenario, found, data, sets)
            folder.finish()
            with page(FIGURES):
                # Loads matplotlib, which a certificate without a folder can do without.
                from pdhocbf_drake.studies.certify.figures import write_certificate_figures

                write_certificate_figures(found, data, Path(out) / FIGURES)
    return data


def _robust(given: Sequence[float] | Mapping[str, Any] | RobustConfig) -> RobustConfig:
    if isinstance(given, RobustConfig):
        return given
    if isinstance(given, Mapping):
        return parse_config(RobustConfig, {"disturbance": dict(given)}, "certify")
    from pdhocbf_drake.sets.disturbance import checked_half_widths  # here, since it loads scipy

    com, velocity = checked_half_widths(given, 2, "of the CoM [m] and of its velocity [m/s]")
    return RobustConfig(disturbance=(com, velocity))


def _terminal(found: ScenarioCertificate) -> tuple[dict[int, TerminalSet], str | None]:
    """The terminal sets, or none and the reason."""
    from pdhocbf_drake.studies.certify.terminal import terminal_sets

    try:
        return terminal_sets(found), None
    except InputError as error:
        return {}, str(error)


def _trial(found: ScenarioCertificate, count: int, ticks: int, progress: Report) -> Trial:
    from pdhocbf_drake.studies.certify.trial import try_sets

    def report(done: int) -> None:
        progress(STAGES - 1, f"trial, {done} of {2 * count} starts")

    return try_sets(found, count, found.scenario.seed, report, ticks)


def _write(
    folder: Path, scenario: Scenario, found: ScenarioCertificate, data: dict[str, Any], sets: dict[int, TerminalSet]
) -> None:
    write_json(folder / CERTIFICATE, data)
    write_yaml(scenario.to_dict(), folder / SCENARIO)
    if sets:
        save_terminal_sets(folder / TERMINAL, sets, limits_of(scenario.gait, scenario.mpc, scenario.barriers))
