"""The gaits to measure: one line for each parameter of the gait, and a map over some of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.gait_variants import (
    AMPLITUDE,
    DOUBLE_SUPPORT,
    HEIGHT,
    KEYS,
    PHASE,
    STEP_TICKS,
    Work,
    varied,
)  # fmt: skip

Grid = Mapping[str, Sequence[float]]


def default_lines(scenario: Scenario) -> dict[str, list[float]]:
    """Values of each key around those of the scenario: phases and step times as shares of its own step."""
    gait = scenario.gait
    ticks, height = gait.ticks_per_step, gait.com_height
    return {
        PHASE: [round(ticks * eighth / 8) for eighth in range(8)],
        HEIGHT: [round(height * share, 4) for share in (0.93, 0.965, 1.0, 1.02)],
        AMPLITUDE: [0.0, 0.005, 0.01, 0.015, 0.02],
        DOUBLE_SUPPORT: sorted({0, ticks // 20, ticks // 10, ticks // 5, ticks // 4}),
        STEP_TICKS: [round(ticks * share) for share in (0.8, 0.9, 1.0, 1.15, 1.3)],
    }


def plan(
    scenario: Scenario, lines: Grid, over: Grid, directions: Sequence[str] = (), phases: Sequence[int] = ()
) -> list[Work]:
    """The gaits to measure, each once; raises `InputError`."""
    if scenario.system == "van_der_pol" or scenario.gait.walk_steps is not None:
        raise InputError(f"scenario '{scenario.name}': a walk without an end is needed (gait.walk_steps: null)")
    check_straight(scenario)
    if unknown := [key for key in (*lines, *over) if key not in KEYS]:
        raise InputError(f"gait.{unknown[0]} can't be varied here; these can: {', '.join(KEYS)}")
    if directions and scenario.system != "biped":
        raise InputError(f"scenario.system: only a 'biped' can be pushed here (given: {scenario.system!r})")
    points = [{key: value} for key, values in lines.items() for value in values]
    points += [dict(zip(over, values, strict=True)) for values in product(*over.values())] if over else []
    unique = {str(values): values for values in points}
    return [
        Work(values, varied(scenario, values).model_dump_json(), tuple(directions), tuple(phases))
        for values in unique.values()
    ]
