"""The study of pushes as a function: the largest impulse survived by barrier, direction and phase of the gait."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pdhocbf_drake.errors import InputError, PdhocbfError
from pdhocbf_drake.files.file import replaced_file, write_text
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.files.pages import page
from pdhocbf_drake.simulation.run_folder import SCENARIO
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.studies.shared.cases import CASES
from pdhocbf_drake.studies.shared.events import DIRECTIONS
from pdhocbf_drake.studies.shared.pool import check_workers
from pdhocbf_drake.studies.shared.results import collected, write_json
from pdhocbf_drake.yaml_text import write_yaml

if TYPE_CHECKING:
    from pdhocbf_drake.studies.shared.push_search import Impulse

RESULT = "push.json"
TABLE = "push.txt"
POLAR = "push.png"
PHASES = "push_phases.png"
_ENTRIES = {RESULT, TABLE, POLAR, PHASES, SCENARIO}


def push(
    scenario: Scenario,
    *,
    directions: Sequence[str] = ("+x", "-x", "+y", "-y"),
    phases: int | Sequence[int] = 8,
    barriers: Sequence[str] = CASES,
    tolerance: float = 1.0,
    duration: float = 0.1,
    watch: float = 3.2,
    workers: int = 1,
    out: str | Path | None = None,
    progress: Callable[[int], None] | None = None,
    found: Callable[[list[Impulse]], None] | None = None,
) -> list[Impulse]:
    """The largest impulse at the torso that the robot survives, by bisection, as `pdhocbf push` finds it.

    Args:
        scenario: a walk of the robot.
        directions: some of "+x" (forward), "-x", "+y" (left), "-y".
        phases: ticks of the gait at which pushes begin, or how many of them, evenly spread over the gait.
        barriers: some of "none", "DCBF", "P-DHOCBF"; a scenario without barriers gets those of `walking`.
        tolerance: resolution of the answer [N s].
        duration: length of a push [s].
        watch: time simulated from the push on [s].
        workers: processes; with more than one, the calling script needs `if __name__ == "__main__":`.
        out: a folder for push.json, push.txt, two figures and the scenario.
        progress: called with the number of impulses found so far, of len(barriers)·len(directions)·len(phases).
        found: called with all of them before the files are written, since the disk may be full.

    Returns:
        An `Impulse` (barrier, direction, phase, survived [N s]) for each barrier, direction and phase.

    Raises:
        InputError: the scenario is no walk of a robot, or an argument can't be used.
        RunFolderError: `out` can't be written.
        PdhocbfError: a worker process died, or Ctrl-C ended the search; what had been found is in `out` all the same.
        Warns of a figure that can't be drawn (`PageWarning`).
    """
    at = _check_events(directions, phases, scenario.gait.ticks_per_gait)
    lists: list[list[Any]] = [list(barriers), list(directions), at]
    shortest_watch = duration + scenario.gait.ticks_per_gait * scenario.gait.tick
    for name, value, least, unit in (
        ("tolerance", tolerance, 0.01, "N s"), ("duration", duration, 0.01, "s"), ("watch", watch, shortest_watch, "s"),
    ):  # fmt: skip
        if not least <= value < 1e3:
            raise InputError(f"{name} must be at least {least:g} and below 1000 {unit} (given: {value:g})")
    if not barriers or not set(barriers) <= set(CASES):
        raise InputError(f"barriers: a list of {', '.join(CASES)} is needed (given: {','.join(barriers)!r})")
    check_workers(workers)
    if scenario.system != "biped":
        raise InputError(f"scenario.system: only a 'biped' can be pushed here (given: {scenario.system!r})")
    with nullcontext() if out is None else new_folder(Path(out), _ENTRIES, "a folder of push") as folder:
        # Here, since they load Drake: an argument that can't be used is refused at once.
        from pdhocbf_drake.robot import Biped
        from pdhocbf_drake.studies.push.results import document, table
        from pdhocbf_drake.studies.shared.push_search import Settings, search_all

        settings, mass = Settings(tolerance, duration, watch), Biped.load(scenario.robot).mass
        searches = search_all(scenario, barriers, directions, at, settings, workers, mass)
        impulses, stopped = collected(searches, folder is not None, progress)
        with stop_requests():  # what has been found is written before such a request takes effect
            impulses.sort(key=lambda impulse: [*map(list.index, lists, impulse[:3])])
            if found is not None:
                found(impulses)
            if folder is not None and out is not None:
                write_json(folder.path / RESULT, document(impulses))
                write_text(folder.path / TABLE, table(impulses) + "\n")
                write_yaml(scenario.to_dict(), folder.path / SCENARIO)
                folder.finish()
                _draw(Path(out), impulses, scenario.gait.ticks_per_step)
    if stopped:
        raise PdhocbfError(f"{stopped}; {len(impulses)} of {math.prod(map(len, lists))} impulses are in {out}")
    return impulses


def _check_events(directions: Sequence[str], phases: int | Sequence[int], ticks: int) -> list[int]:
    """The phases as ticks of the gait; raises `InputError`."""
    if not directions or not set(directions) <= set(DIRECTIONS):
        raise InputError(f"directions: some of {', '.join(DIRECTIONS)} are needed (given: {','.join(directions)!r})")
    if isinstance(phases, int):
        if not 1 <= phases <= ticks:
            raise InputError(f"phases: 1 to {ticks} of them, or a list of ticks of the gait (given: {phases})")
        return [ticks * i // phases for i in range(phases)]
    if not phases or not all(0 <= phase < ticks for phase in phases):
        raise InputError(f"phases: ticks of the gait are 0 to {ticks - 1} (given: {list(phases)})")
    return list(phases)


def _draw(folder: Path, impulses: Sequence[Impulse], ticks_per_step: int) -> None:
    from pdhocbf_drake.studies.push.results import draw_phases, draw_polar

    with page(POLAR), replaced_file(folder / POLAR) as staging:
        draw_polar(impulses, staging)
    with page(PHASES), replaced_file(folder / PHASES) as staging:
        draw_phases(impulses, staging, ticks_per_step)
