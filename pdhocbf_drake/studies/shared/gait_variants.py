"""Variants of a scenario's gait."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from pdhocbf_drake.simulation.scenario import Scenario

PHASE, HEIGHT, AMPLITUDE = "com_height_phase", "com_height", "com_height_amplitude"
DOUBLE_SUPPORT, STEP_TICKS = "double_support_ticks", "ticks_per_step"
KEYS: Final = (PHASE, HEIGHT, AMPLITUDE, DOUBLE_SUPPORT, STEP_TICKS)
"""The keys of `gait` that can be varied."""


class Work(NamedTuple):
    """One gait to measure: a scenario as JSON, and the pushes to try (directions, ticks of the gait)."""

    values: dict[str, Any]
    scenario: str
    directions: tuple[str, ...] = ()
    phases: tuple[int, ...] = ()


def varied(scenario: Scenario, values: Mapping[str, float]) -> Scenario:
    """The scenario with other values of its gait, seconds of horizon in whole gaits.

    Without another stride it has the same commanded speed.

    Raises:
        InputError: a value that is not allowed.
    """
    data = scenario.to_dict()
    gait: dict[str, Any] = {**data["gait"], **values}
    before, after = scenario.gait.ticks_per_step, gait["ticks_per_step"]
    if after != before:
        gait["stride"] = values.get("stride", scenario.gait.stride * after / before)
        data["mpc"]["horizon"] = scenario.mpc.horizon // (2 * before) * 2 * after
    return Scenario.from_dict({**data, "gait": gait}, scenario.name)
