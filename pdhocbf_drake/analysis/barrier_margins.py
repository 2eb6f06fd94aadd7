"""The barriers of a run, judged on the measured state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.barriers.class_k import ClassK, Linear
from pdhocbf_drake.barriers.margin import BarrierRecord, record_from_h
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario


class BarrierUse(NamedTuple):
    """A barrier as a scenario uses it: column of the signal `h`, class-K functions, relative degree, unit of h."""

    column: int
    class_k: tuple[ClassK, ...]
    gamma: tuple[float, ...]
    relative_degree: int
    unit: str


def barriers_of(scenario: Scenario) -> dict[str, BarrierUse]:
    """The scenario's barriers by name, in the order of the log's columns."""
    if scenario.system == "van_der_pol":
        first, second = scenario.van_der_pol.gamma_1, scenario.van_der_pol.gamma_2
        table = {
            "x1_upper": (first, "1"),
            "x1_lower": (first, "1"),
            "x2_upper": (second, "1/s"),
            "x2_lower": (second, "1/s"),
        }
        return {
            name: BarrierUse(column, tuple(Linear(rate) for rate in gamma), gamma, len(gamma), unit)
            for column, (name, (gamma, unit)) in enumerate(table.items())
        }
    return {
        name: BarrierUse(
            column, config.make_class_k(), config.gamma, config.relative_degree or len(config.gamma), config.unit
        )
        for column, (name, config) in enumerate(scenario.barriers.items())
    }


def record_of(log: RunLog, use: BarrierUse, from_time: float) -> BarrierRecord | None:
    """h and ψ on the measured state from `from_time` on; None where the log has no finite rows there."""
    h = log.after(from_time)["h"][:, use.column]
    try:
        return record_from_h(h, use.class_k)
    except InputError:
        return None


def bound_along(log: RunLog, scenario: Scenario, use: BarrierUse) -> np.ndarray:
    """V̄(k) at each row, (T,), from the samples over the horizon of which it is the first."""
    count = len(barriers_of(scenario))
    samples = log["barrier_bound"]
    return np.asarray(samples[:, use.column * (samples.shape[1] // count)])
