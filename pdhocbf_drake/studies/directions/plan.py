"""The pieces of work of the table, and what does each of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.directions import (
    pushes,
    sequences,
    steady,
    stops,
    straight,
    symmetry,
    template,
    waypoints,
)
from pdhocbf_drake.studies.shared.checks import Outcome
from pdhocbf_drake.studies.shared.work import Work

_MODULES: Final = {
    **dict.fromkeys(steady.ROWS, steady),
    **dict.fromkeys(waypoints.ROWS, waypoints),
    stops.ROW: stops,
    symmetry.ROW: symmetry,
    straight.ROW: straight,
    template.ROW: template,
    sequences.ROW: sequences,
    pushes.ROW: pushes,
}
ROWS: Final = tuple(_MODULES)
"""The rows of the table, in its order."""
QUICK_ROWS: Final = tuple(row for row in ROWS if row != pushes.ROW)


def plan(
    scenario: Scenario, rows: Sequence[str] | None = None, quick: bool = False, walks: int = 20, seed: int = 1
) -> list[Work]:
    """The pieces of work, the longest rows first; raises `InputError`."""
    if scenario.system != "biped" or scenario.gait.walk_steps is not None:
        raise InputError(
            f"scenario '{scenario.name}': a walk of a robot without an end is needed (system: biped, gait.walk_steps: "
            "null)"
        )
    check_straight(scenario)
    chosen = list(rows) if rows is not None else list(QUICK_ROWS if quick else ROWS)
    if unknown := [row for row in chosen if row not in ROWS]:
        raise InputError(f"rows: some of {', '.join(ROWS)} are needed (given: {unknown[0]!r})")
    if not chosen:
        raise InputError(f"rows: some of {', '.join(ROWS)} are needed (given: none)")
    if walks < 1 or seed < 0:
        raise InputError(f"walks must be 1 or more, and seed 0 or more (given: {walks} and {seed})")
    text = scenario.model_dump_json()
    pieces = [
        piece
        for row in dict.fromkeys(chosen)
        for piece in (
            sequences.plan(text, seed, min(walks, 2) if quick else walks, quick)
            if row == sequences.ROW
            else _MODULES[row].plan(row, text, quick)
        )
    ]
    return sorted(pieces, key=lambda piece: piece.row != pushes.ROW)


def measure(work: Work) -> Outcome:
    """Does one piece of work."""
    outcome: Outcome = _MODULES[work.row].measure(work)
    return outcome
