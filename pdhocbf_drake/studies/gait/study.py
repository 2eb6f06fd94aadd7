"""The study of gaits as a function: one line for each parameter of the gait, and a map over two of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from itertools import product
from pathlib import Path
from typing import Any, Final

from pdhocbf_drake.errors import InputError, PdhocbfError
from pdhocbf_drake.files.file import write_text
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.run_folder import SCENARIO
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.studies.gait.measures import GaitMeasures, Work, measure
from pdhocbf_drake.studies.gait.results import LINES, MAP, document, table, write_figures
from pdhocbf_drake.studies.shared.pool import in_processes
from pdhocbf_drake.studies.shared.results import collected, write_json
from pdhocbf_drake.yaml_text import write_yaml

PHASE, HEIGHT, AMPLITUDE = "com_height_phase", "com_height", "com_height_amplitude"
DOUBLE_SUPPORT, STEP_TICKS = "double_support_ticks", "ticks_per_step"
KEYS: Final = (PHASE, HEIGHT, AMPLITUDE, DOUBLE_SUPPORT, STEP_TICKS)
"""The keys of `gait` that can be varied."""

RESULT, TABLE = "gait.json", "gait.txt"
_ENTRIES = {RESULT, TABLE, LINES, MAP, SCENARIO}
Grid = Mapping[str, Sequence[float]]


def default_lines(scenario: Scenario) -> dict[str, list[float]]:
    """Values of each key around those of the scenario: phases and step times as shares of its own step."""
    gait = scenario.gait
    ticks, height = gait.ticks_per_step, gait.com_height
    return {
        PHASE: [round(ticks * eighth / 8) for eighth in range(8)],
        HEIGHT: [round(height * share, 4) for share in (0.93, 0.965, 1.0, 1.02)],
        AMPLITUDE: [0.0, 0.005, 0.01, 0.015, 0.02],
        DOUBLE_SUPPORT: sorted({0, ticks // 20, ticks // 10, ticks // 5, ticks // 4}),
        STEP_TICKS: [round(ticks * share) for share in (0.8, 0.9, 1.0, 1.15, 1.3)],
    }


def gait_study(
    scenario: Scenario,
    *,
    lines: Grid | None = None,
    over: Grid | None = None,
    directions: Sequence[str] = (),
    phases: Sequence[int] = (),
    workers: int = 1,
    out: str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[GaitMeasures]:
    """Measures gaits around a scenario's own one.

    Args:
        scenario: a walk without an end, on the robot or on the template.
        lines: for each key the values that it takes while all others are the scenario's; None: `default_lines`.
        over: keys and values of which every combination is measured; None: none.
        directions, phases: pushes to try on the robot, see `push`; none by default, since they take the longest.
        workers: processes; with more than one, the calling script needs `if __name__ == "__main__":`.
        out: a folder for gait.json, gait.txt, figures and the scenario.
        progress: called with the number of gaits measured so far.

    Raises:
        InputError: the scenario is no walk without an end, or a key can't be varied.
        RunFolderError: `out` can't be written. PdhocbfError: a worker process died, or Ctrl-C ended the work; what had
            been measured is in `out` all the same.
    """
    work = plan(scenario, default_lines(scenario) if lines is None else lines, over or {}, directions, phases)
    with nullcontext() if out is None else new_folder(Path(out), _ENTRIES, "a folder of gait") as folder:
        measured = ([gait] for gait in in_processes(measure, work, workers))
        gaits, stopped = collected(measured, folder is not None, progress)
        with stop_requests():  # what has been measured is written before such a request takes effect
            order = [str(piece.values) for piece in work]
            gaits.sort(key=lambda gait: order.index(str(gait.values)))
            if folder is not None and out is not None:
                write_text(folder.path / TABLE, table(gaits) + "\n")
                write_json(folder.path / RESULT, document(scenario, gaits))
                write_yaml(scenario.to_dict(), folder.path / SCENARIO)
                folder.finish()
                write_figures(gaits, Path(out))
    if stopped:
        raise PdhocbfError(f"{stopped}; {len(gaits)} of {len(work)} gaits are in {out}")
    return gaits


def plan(
    scenario: Scenario, lines: Grid, over: Grid, directions: Sequence[str] = (), phases: Sequence[int] = ()
) -> list[Work]:
    """The gaits to measure, each once; raises `InputError`."""
    if scenario.system == "van_der_pol" or scenario.gait.walk_steps is not None:
        raise InputError(f"scenario '{scenario.name}': a walk without an end is needed (gait.walk_steps: null)")
    check_straight(scenario)
    if unknown := [key for key in (*lines, *over) if key not in KEYS]:
        raise InputError(f"gait.{unknown[0]} can't be varied here; these can: {', '.join(KEYS)}")
    if directions and scenario.system != "biped":
        raise InputError(f"scenario.system: only a 'biped' can be pushed here (given: {scenario.system!r})")
    points = [{key: value} for key, values in lines.items() for value in values]
    points += [dict(zip(over, values, strict=True)) for values in product(*over.values())] if over else []
    unique = {str(values): values for values in points}
    return [
        Work(values, varied(scenario, values).model_dump_json(), tuple(directions), tuple(phases))
        for values in unique.values()
    ]


def varied(scenario: Scenario, values: Mapping[str, float]) -> Scenario:
    """The scenario with other values of its gait, at the same commanded speed, seconds of horizon in whole gaits.

    Raises:
        InputError: a value that is not allowed.
    """
    data = scenario.to_dict()
    gait: dict[str, Any] = {**data["gait"], **values}
    before, after = scenario.gait.ticks_per_step, gait["ticks_per_step"]
    if after != before:
        gait["stride"] = scenario.gait.stride * after / before
        data["mpc"]["horizon"] = scenario.mpc.horizon // (2 * before) * 2 * after
    return Scenario.from_dict({**data, "gait": gait}, scenario.name)
