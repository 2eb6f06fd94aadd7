"""The study of commanded walks as a function: each row of the table is walked, measured, and put beside its limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.simulation.run_folder import SCENARIO
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.studies.directions.plan import ROWS, measure, plan
from pdhocbf_drake.studies.shared.check_table import write_table
from pdhocbf_drake.studies.shared.checks import Check, combined
from pdhocbf_drake.studies.shared.pool import in_processes
from pdhocbf_drake.studies.shared.results import collected

RESULT, TABLE = "directions.json", "directions.txt"
_ENTRIES = {RESULT, TABLE, SCENARIO, *(row.replace(" ", "_") for row in ROWS)}


def directions(
    scenario: Scenario,
    *,
    rows: Sequence[str] | None = None,
    quick: bool = False,
    walks: int = 20,
    seed: int = 1,
    workers: int = 1,
    out: str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> tuple[list[Check], list[str]]:
    """Walks in every direction, beside what they must reach.

    Args:
        scenario: a walk of the robot without commands; its own barriers are judged.
        rows: some of `ROWS`; None: all of them, or where quick all but the pushes.
        quick: walk for a few seconds each, and few of each kind.
        walks, seed: of the random sequences of commands.
        workers: processes; with more than one, the calling script needs `if __name__ == "__main__":`.
        out: a folder for directions.json, directions.txt, the scenario, and the run folders of single walks.
        progress: called with the number of pieces of work done so far, of `len(plan(...))`.

    Returns:
        The checks, and sentences on falls and pushes.

    Raises:
        InputError: the scenario is no walk of a robot without commands, or an argument can't be used.
        RunFolderError: `out` can't be written. PdhocbfError: a worker process died, or Ctrl-C ended the work; what had
            been measured is in `out` all the same.
    """
    chosen = plan(scenario, rows, quick, walks, seed)
    with nullcontext() if out is None else new_folder(Path(out), _ENTRIES, "a folder of directions") as folder:
        place = None if folder is None or quick else str(folder.path)
        work = [piece._replace(folder=place) for piece in chosen]
        outcomes, stopped = collected(
            ([outcome] for outcome in in_processes(measure, work, workers)), folder is not None, progress
        )
        with stop_requests():  # what has been measured is written before such a request takes effect
            checks = combined(sorted((c for o in outcomes for c in o.checks), key=lambda check: ROWS.index(check.row)))
            notes = sorted(note for outcome in outcomes for note in outcome.notes)
            if folder is not None:
                write_table(folder.path, TABLE, RESULT, scenario, checks, notes)
                folder.finish()
    if stopped:
        raise PdhocbfError(f"{stopped}; {len(outcomes)} of {len(work)} pieces of the table are in {out}")
    return checks, notes
