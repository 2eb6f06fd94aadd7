"""The study of uneven ground as a function: each row of the table is walked, measured, and put beside its limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.ground.plan import ROWS, measure, plan
from pdhocbf_drake.studies.shared.checks import Check, combined
from pdhocbf_drake.studies.shared.table_study import measured_table
from pdhocbf_drake.studies.shared.work import Work


def ground(
    scenario: Scenario,
    *,
    rows: Sequence[str] | None = None,
    quick: bool = False,
    walks: int = 30,
    seed: int = 1,
    workers: int = 1,
    out: str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> tuple[list[Check], list[str]]:
    """Walks over each kind of ground, beside what they must reach.

    Args:
        scenario: a walk of the robot on flat ground; its gait, but for what each ground asks for.
        rows: some of `ROWS`; None: all of them.
        quick: short ground, and few walks of each kind.
        walks, seed: of random ground.
        workers: processes; with more than one, the calling script needs `if __name__ == "__main__":`.
        out: a folder for ground.json, ground.txt, the scenario, and the run folders of single walks.
        progress: called with the number of pieces of work done so far, of `len(plan(...))`.

    Returns:
        The checks, and sentences on what was chosen for each ground and on falls.

    Raises:
        InputError: the scenario is no walk of a robot on flat ground, or an argument can't be used.
        RunFolderError: `out` can't be written. PdhocbfError: a worker process died, or Ctrl-C ended the work; what had
            been measured is in `out` all the same.
    """
    chosen = plan(scenario, rows, quick, walks, seed)

    def pieces(folder: Path | None) -> list[Work]:
        place = None if folder is None or quick else str(folder)
        return [piece._replace(folder=place) for piece in chosen]

    def together(checks: Iterable[Check]) -> list[Check]:
        return combined(sorted(checks, key=lambda check: ROWS.index(check.row)))

    return measured_table(
        "ground", scenario, pieces, measure, together,
        workers=workers, out=out, entries=[row.replace(" ", "_") for row in ROWS], progress=progress,
    )  # fmt: skip
