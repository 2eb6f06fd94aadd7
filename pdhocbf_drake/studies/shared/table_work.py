"""The work of a table of what walks must reach: its pieces, as far as they came, and the folder of its results."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.files.folder import new_folder
from pdhocbf_drake.simulation.run_folder import SCENARIO
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.stopping import stop_requests
from pdhocbf_drake.studies.shared.check_table import write_table
from pdhocbf_drake.studies.shared.checks import Check, Outcome
from pdhocbf_drake.studies.shared.pool import in_processes
from pdhocbf_drake.studies.shared.results import collected
from pdhocbf_drake.studies.shared.row_kinds import Table


def measured_table(
    name: str,
    scenario: Scenario,
    table: Table,
    work: Sequence[Any],
    entries: Collection[str],
    keep: bool,
    workers: int,
    out: str | Path | None,
    progress: Callable[[int], None] | None = None,
) -> tuple[list[Check], list[str]]:
    """Does the pieces of work, puts their checks together, and writes NAME.json, NAME.txt and the scenario.

    Args:
        name: of the study.
        scenario: what is studied.
        table: of the pieces.
        work: the pieces, each with its `row`.
        entries: run folders that may be in the folder.
        keep: whether the pieces, which are `Work` then, write such run folders.
        workers: processes.
        out: the folder; None writes nothing.
        progress: called with the number of pieces done so far.

    Raises:
        RunFolderError: `out` can't be written. PdhocbfError: a worker process died, or Ctrl-C ended the work; what had
            been measured is in `out` all the same.
    """
    text, data = f"{name}.txt", f"{name}.json"
    kept = {text, data, SCENARIO, *entries}
    with nullcontext() if out is None else new_folder(Path(out), kept, f"a folder of {name}") as folder:
        if keep and folder is not None:
            work = [piece._replace(folder=str(folder.path)) for piece in work]
        pieces = [(table.kinds[piece.row].measure, piece) for piece in work]
        measured = ([outcome] for outcome in in_processes(_done, pieces, workers))
        outcomes, stopped = collected(measured, folder is not None, progress)
        with stop_requests():  # what has been measured is written before such a request takes effect
            together = table.in_order if table.together is None else table.together
            checks = together(check for outcome in outcomes for check in outcome.checks)
            notes = sorted(note for outcome in outcomes for note in outcome.notes)
            if folder is not None:
                write_table(folder.path, text, data, scenario, checks, notes)
                folder.finish()
    if stopped:
        raise PdhocbfError(f"{stopped}; {len(outcomes)} of {len(work)} pieces of the table are in {out}")
    return checks, notes


def _done(piece: tuple[Callable[[Any], Outcome], Any]) -> Outcome:
    measure, work = piece
    return measure(work)
