"""The study of pushes as a function: the largest impulse survived by barrier, direction and phase of the gait."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.run_folder import replaced_file
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.push.results import Impulse, document, draw_phases, draw_polar, table
from pdhocbf_drake.studies.push.search import Settings, search_all
from pdhocbf_drake.studies.shared.cases import CASES
from pdhocbf_drake.studies.shared.events import DIRECTIONS
from pdhocbf_drake.studies.shared.results import result_folder, write_json, write_text

RESULT = "push.json"


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
        PdhocbfError: a worker process died.
    """
    at = _check_events(directions, phases, scenario.gait.ticks_per_gait)
    settings = Settings(tolerance, duration, watch)
    shortest_watch = duration + scenario.gait.ticks_per_gait * scenario.gait.tick
    for name, least in (("tolerance", 0.01), ("duration", 0.01), ("watch", shortest_watch)):
        value = getattr(settings, name)
        if not least <= value < 1e3:
            raise InputError(f"{name} must be at least {least:g} (given: {value:g})")
    if not barriers or not set(barriers) <= set(CASES):
        raise InputError(f"barriers: a list of {', '.join(CASES)} is needed (given: {','.join(barriers)!r})")
    if workers < 1:
        raise InputError(f"workers must be 1 or more (given: {workers})")
    if scenario.system != "biped":
        raise InputError(f"scenario.system: only a 'biped' can be pushed here (given: {scenario.system!r})")
    folder = None if out is None else result_folder(Path(out), "push", scenario)
    mass = Biped.load(scenario.robot).mass
    impulses = search_all(scenario, barriers, directions, at, settings, workers, mass, progress)
    if found is not None:
        found(impulses)
    if folder is not None:
        _write(folder, scenario, impulses)
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


def _write(folder: Path, scenario: Scenario, impulses: Sequence[Impulse]) -> None:
    """Writes the results; each file is complete or not there."""
    with replaced_file(folder / "push.png") as staging:
        draw_polar(impulses, staging)
    with replaced_file(folder / "push_phases.png") as staging:
        draw_phases(impulses, staging, scenario.gait.ticks_per_step)
    write_text(folder / "push.txt", table(impulses))
    write_json(folder / RESULT, document(impulses))
