"""A study whose result is a table of what walks must reach: its pieces of work, as far as they came, and its folder."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TypeVar

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.simulation.run_folder import SCENARIO
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.studies.shared.check_table import write_table
from pdhocbf_drake.studies.shared.checks import Check, Outcome
from pdhocbf_drake.studies.shared.pool import in_processes
from pdhocbf_drake.studies.shared.results import collected

Work = TypeVar("Work")


def measured_table(
    name: str,
    scenario: Scenario,
    pieces: Callable[[Path | None], Sequence[Work]],
    measure: Callable[[Work], Outcome],
    together: Callable[[Iterable[Check]], list[Check]],
    *,
    workers: int,
    out: str | Path | None,
    entries: Collection[str] = (),
    progress: Callable[[int], None] | None = None,
) -> tuple[list[Check], list[str]]:
    """Does the pieces of work, puts their checks together, and writes NAME.json, NAME.txt and the scenario.

    Args:
        name: of the study.
        scenario: what is studied.
        pieces: the pieces of work, given the folder that is being filled, or None.
        measure: does one piece.
        together: the checks of the table, from those of all pieces.
        workers: processes.
        out: the folder; None writes nothing.
        entries: what the pieces write into it.
        progress: called with the number of pieces done so far.

    Raises:
        RunFolderError: `out` can't be written. PdhocbfError: a worker process died, or Ctrl-C ended the work; what had
            been measured is in `out` all the same.
    """
    text, data = f"{name}.txt", f"{name}.json"
    kept = {text, data, SCENARIO, *entries}
    with nullcontext() if out is None else new_folder(Path(out), kept, f"a folder of {name}") as folder:
        work = pieces(None if folder is None else folder.path)
        measured = ([outcome] for outcome in in_processes(measure, work, workers))
        outcomes, stopped = collected(measured, folder is not None, progress)
        with stop_requests():  # what has been measured is written before such a request takes effect
            checks = together(check for outcome in outcomes for check in outcome.checks)
            notes = sorted(note for outcome in outcomes for note in outcome.notes)
            if folder is not None:
                write_table(folder.path, text, data, scenario, checks, notes)
                folder.finish()
    if stopped:
        raise PdhocbfError(f"{stopped}; {len(outcomes)} of {len(work)} pieces of the table are in {out}")
    return checks, notes
