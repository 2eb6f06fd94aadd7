"""The study of delay, noise and model errors as a function: rows walked from several seeds, beside their limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.sensing.rows import EXACT, ROWS
from pdhocbf_drake.studies.sensing.walks import ZMP, Walk, measure
from pdhocbf_drake.studies.shared.checks import Check, combined
from pdhocbf_drake.studies.shared.table_study import measured_table

_QUICK = 6.0  # [s]


def plan(scenario: Scenario, rows: Sequence[str] | None = None, seeds: int = 10, quick: bool = False) -> list[Walk]:
    """The walks of the table, the longest first; raises `InputError`."""
    if scenario.system != "biped" or scenario.gait.walk_steps is not None or not scenario.gait.stride:
        raise InputError(
            f"scenario '{scenario.name}': a walk of a robot without an end is needed (system: biped, gait.walk_steps: "
            "null, a gait.stride)"
        )
    check_straight(scenario)
    chosen = list(ROWS if rows is None else rows)
    unknown = [row for row in chosen if row not in ROWS]
    if unknown or not chosen:
        raise InputError(f"rows: some of {', '.join(ROWS)} are needed (given: {unknown[0] if unknown else 'none'!r})")
    if seeds < 1:
        raise InputError(f"seeds must be 1 or more (given: {seeds})")
    text = scenario.model_dump_json()
    walks = [
        Walk(row, text, seed, _QUICK if quick else None)
        for row in dict.fromkeys([EXACT, *chosen])
        for seed in range(1 if quick else seeds)
    ]
    for walk in walks:
        walk.sensed()
    return sorted(walks, key=lambda walk: -ROWS[walk.row].duration)


def sensing(
    scenario: Scenario,
    *,
    rows: Sequence[str] | None = None,
    seeds: int = 10,
    quick: bool = False,
    workers: int = 1,
    out: str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> tuple[list[Check], list[str]]:
    """Walks with late, noisy and wrong knowledge of the robot, beside what they must reach.

    Args:
        scenario: a straight walk of the robot; its own barriers are judged.
        rows: some of `ROWS`, beside which the exact walk is always walked; None for all.
        seeds: 0 … seeds − 1, of noise, start and heading.
        quick: seed 0 alone, for a few seconds each.
        workers: processes; with more than one, the calling script needs `if __name__ == "__main__":`.
        out: a folder for sensing.json, sensing.txt and the scenario.
        progress: called with the number of walks done so far, of `len(plan(...))`.

    Returns:
        The checks, and sentences on falls.

    Raises:
        InputError: the scenario is no straight walk of a robot, or an argument can't be used.
        RunFolderError: `out` can't be written. PdhocbfError: a worker process died, or Ctrl-C ended the work; what had
            been measured is in `out` all the same.
    """
    work = plan(scenario, rows, seeds, quick)
    return measured_table(
        "sensing", scenario, lambda _: work, measure, beside_exact, workers=workers, out=out, progress=progress
    )


def beside_exact(checks: Iterable[Check]) -> list[Check]:
    """One check for each row and what is measured of it; limits on the ZMP count from the exact walk's share."""
    order = list(ROWS)
    together = combined(sorted(checks, key=lambda check: order.index(check.row)))
    exact = next((check.value for check in together if (check.row, check.what) == (EXACT, ZMP)), 0.0)
    return [check._replace(limit=check.limit + exact) if check.what == ZMP else check for check in together]
