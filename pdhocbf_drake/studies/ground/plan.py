"""The pieces of work of the table, and what does each of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.ground import courses, held, known, pushes, sensed, unknown
from pdhocbf_drake.studies.shared.checks import Outcome
from pdhocbf_drake.studies.shared.work import Work

_MODULES = {**dict.fromkeys(known.ROWS, known), courses.ROW: courses, pushes.ROW: pushes, held.ROW: held}
_MODULES |= {**dict.fromkeys(unknown.ROWS, unknown), sensed.ROW: sensed}
ROWS: Final = tuple(_MODULES)
"""The rows of the table, in its order."""
_QUICK_WALKS = 2


def plan(
    scenario: Scenario, rows: Sequence[str] | None = None, quick: bool = False, walks: int = 30, seed: int = 1
) -> list[Work]:
    """The pieces of work; raises `InputError`."""
    if scenario.system != "biped" or scenario.gait.walk_steps is not None or scenario.ground:
        raise InputError(
            f"scenario '{scenario.name}': a walk of a robot on flat ground without an end is needed (system: biped, "
            "gait.walk_steps: null, ground: [])"
        )
    check_straight(scenario)
    chosen = list(ROWS) if rows is None else list(rows)
    if unknown := [row for row in chosen if row not in ROWS]:
        raise InputError(f"rows: some of {', '.join(ROWS)} are needed (given: {unknown[0]!r})")
    if not chosen:
        raise InputError(f"rows: some of {', '.join(ROWS)} are needed (given: none)")
    if walks < 1 or seed < 0:
        raise InputError(f"walks must be 1 or more, and seed 0 or more (given: {walks} and {seed})")
    text, count = scenario.model_dump_json(), min(walks, _QUICK_WALKS) if quick else walks
    return [piece for row in dict.fromkeys(chosen) for piece in _plan(row, text, quick, count, seed)]


def _plan(row: str, text: str, quick: bool, walks: int, seed: int) -> list[Work]:
    if row in (courses.ROW, sensed.ROW):
        return list(_MODULES[row].plan(text, seed, walks, quick))
    if row == held.ROW:
        return held.plan(text)
    if row in unknown.ROWS:
        return unknown.plan(row, text, seed, walks)
    return pushes.plan(text, quick) if row == pushes.ROW else known.plan(row, text, quick)


def measure(work: Work) -> Outcome:
    """Does one piece of work."""
    outcome: Outcome = _MODULES[work.row].measure(work)
    return outcome
