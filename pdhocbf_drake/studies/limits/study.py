"""The study of limits as a function: rows with the whole-body program and without, beside what they must reach."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.limits.joints import joint_checks
from pdhocbf_drake.studies.limits.program import program_checks
from pdhocbf_drake.studies.limits.rows import ALL, BARRIERS, PROGRAM, ROWS
from pdhocbf_drake.studies.limits.walks import CLOSED, Walk, measure
from pdhocbf_drake.studies.limits.weak import Peaks
from pdhocbf_drake.studies.shared.checks import Check, Outcome, combined
from pdhocbf_drake.studies.shared.table_study import measured_table

_QUICK = 4.0  # [s]
_POSTURES, _TICKS = 1000, 1000


class Counted(NamedTuple):
    """Work that is no walk: a row, the scenario as JSON, the peaks of its walk, and how many postures or ticks."""

    row: str
    scenario: str
    peaks: Peaks
    number: int


Work = Walk | Counted


def plan(scenario: Scenario, rows: Sequence[str] | None = None, quick: bool = False) -> list[Work]:
    """The pieces of the table; raises `InputError`."""
    if scenario.system != "biped" or scenario.gait.walk_steps is not None or not scenario.gait.stride:
        raise InputError(
            f"scenario '{scenario.name}': a walk of a robot without an end is needed (system: biped, gait.walk_steps: "
            "null, a gait.stride)"
        )
    check_straight(scenario)
    chosen = list(ALL if rows is None else rows)
    unknown = [row for row in chosen if row not in ALL]
    if unknown or not chosen:
        raise InputError(f"rows: some of {', '.join(ALL)} are needed (given: {unknown[0] if unknown else 'none'!r})")
    text, peaks, work = scenario.model_dump_json(), Peaks.of(scenario), list[Work]()
    for row in dict.fromkeys(chosen):
        if row in ROWS:
            kinds = ["auto"] if quick or ROWS[row].slip is not None else ["auto", "closed_form"]
            work += [Walk(row, text, peaks, kind, _QUICK if quick else None) for kind in kinds]
        else:
            count = _POSTURES if row == BARRIERS else _TICKS
            work.append(Counted(row, text, peaks, count // 5 if quick else count))
    return work


def limits(
    scenario: Scenario,
    *,
    rows: Sequence[str] | None = None,
    quick: bool = False,
    workers: int = 1,
    out: str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> tuple[list[Check], list[str]]:
    """Walks at the limits of joints and ground, beside what they must reach.

    Args:
        scenario: a straight walk of the robot, whose joints' peaks are taken.
        rows: some of `ALL`; None for all.
        quick: a few seconds of each, without the closed form beside it.
        workers: processes; with more than one, the calling script needs `if __name__ == "__main__":`.
        out: a folder for limits.json, limits.txt and the scenario.
        progress: called with the number of pieces done so far, of `len(plan(...))`.

    Returns:
        The checks, and sentences on falls, refusals and what is granted.

    Raises:
        InputError: the scenario is no straight walk of a robot, or an argument can't be used.
        RunFolderError: `out` can't be written. PdhocbfError: a worker process died, or Ctrl-C ended the work; what had
            been measured is in `out` all the same.
    """
    work = plan(scenario, rows, quick)
    return measured_table(
        "limits", scenario, lambda _: work, done, in_order, workers=workers, out=out, progress=progress
    )


def done(work: Work) -> Outcome:
    """The outcome of a piece of the table."""
    if isinstance(work, Walk):
        return measure(work)
    scenario = Scenario.model_validate_json(work.scenario)
    if work.row == PROGRAM:
        return Outcome(*program_checks(scenario, work.peaks, work.number))
    return Outcome(*joint_checks(scenario, work.number))


def in_order(checks: Iterable[Check]) -> list[Check]:
    """The checks in the order of the rows, the closed form behind the program."""
    order = [name for row in ALL for name in (row, row + CLOSED)]
    return combined(sorted(checks, key=lambda check: order.index(check.row)))
