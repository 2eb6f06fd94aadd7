"""The barriers of a run: the quantity that each one bounds, and that quantity and its bound along the log."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis.heading import along_heading
from pdhocbf_drake.barriers.class_k import ClassK, Linear
from pdhocbf_drake.barriers.recursion import psi_along
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.walking import CosineHeight
from pdhocbf_drake.walking.quantities import SPEEDS, Quantity
from pdhocbf_drake.walking.vhip import Vhip

Array = NDArray[np.float64]

_SAME = 1e-6  # [s]
_ROUNDING = 1e-9  # share of a bound by which rounding may miss it


class BarrierUse(NamedTuple):
    """A barrier of a scenario.

    Attributes:
        column: its column of the signal `h`.
        class_k, gamma: its class-K functions and their slopes.
        relative_degree: as declared [ticks].
        unit: unit of h.
        period: period of its bound [ticks].
        quantity: the quantity of a walk that it bounds; None in other systems.
        seen_anew: whether h jumps where another foot becomes the stance, and the recursion starts again.
        changed: times from which on the barrier is kept in another way [s].
    """

    column: int
    class_k: tuple[ClassK, ...]
    gamma: tuple[float, ...]
    relative_degree: int
    unit: str
    period: int
    quantity: Quantity | None = None
    seen_anew: bool = False
    changed: tuple[float, ...] = ()


def barriers_of(scenario: Scenario) -> dict[str, BarrierUse]:
    """The scenario's barriers by name, in the order of the log's columns."""
    if scenario.system == "van_der_pol":
        config = scenario.van_der_pol
        states = (("x1", config.gamma_1, "1"), ("x2", config.gamma_2, "1/s"))
        sides = [(f"{state}_{side}", gamma, unit) for state, gamma, unit in states for side in ("upper", "lower")]
        return {
            name: BarrierUse(column, tuple(map(Linear, gamma)), gamma, len(gamma), unit, config.ticks_per_period)
            for column, (name, gamma, unit) in enumerate(sides)
        }
    return {
        name: BarrierUse(
            column, config.make_class_k(), config.gamma, config.relative_degree or len(config.gamma), config.unit,
            config.bounded.period(scenario.gait.ticks_per_step), config.bounded,
            config.bounded.seen_anew or bool(scenario.commands or scenario.path),
            tuple(change.time for change in scenario.barrier_changes if change.name == name),
        )
        for column, (name, config) in enumerate(scenario.barriers.items())
    }  # fmt: skip


def units_of(scenarios: Iterable[Scenario]) -> str:
    """The units of h of all barriers, each once; of scenarios without barriers, that of the forward speed."""
    units = [use.unit for scenario in scenarios for use in barriers_of(scenario).values()]
    return ", ".join(dict.fromkeys(units)) or SPEEDS[0].unit


def quantities_of(scenarios: Iterable[Scenario]) -> list[Quantity]:
    """The quantities that walks bound, each once, those of x first; the forward speed if there is none."""
    bounded = {config.bounded for scenario in scenarios for config in scenario.barriers.values()} or {SPEEDS[0]}
    return sorted(bounded, key=lambda quantity: (quantity.axis, quantity.name, quantity.mirrored))


def named(run: Run, quantity: Quantity) -> str:
    """The quantity's name; in a walk that follows commands x is along the heading, and y across it."""
    if "path" not in run.log:
        return quantity.label
    return (
        f"{quantity.label.removesuffix(' in ' + 'xy'[quantity.axis])} {('along', 'across')[quantity.axis]} the heading"
    )


def measured(run: Run, quantity: Quantity) -> Array:
    """The measured quantity at each row, (T,) [its unit]."""
    seen = [along_heading(run.log, "lip_state", i, i + 3)[:, quantity.axis] for i in range(3)]
    return _values(run, quantity, np.column_stack(seen))


def planned(run: Run, quantity: Quantity) -> Array:
    """The planned quantity at each row, (T,) [its unit]."""
    parts = ("com_reference", 0, 3), ("com_reference", 1, 4), ("zmp_reference", 0, 2)
    seen = [along_heading(run.log, *part)[:, quantity.axis] for part in parts]
    return _values(run, quantity, np.column_stack(seen))


def _values(run: Run, quantity: Quantity, states: Array) -> Array:
    gait = run.scenario.gait
    ticks = np.rint(run.log.time / gait.tick).astype(int)
    stance = along_heading(run.log, "stance_plan", 2, 3)[:, quantity.axis]
    return quantity.values(states, ticks, Vhip(CosineHeight(gait).eta(), gait.tick), gait, stance)


def psi_along_log(log: RunLog, use: BarrierUse) -> Array:
    """ψ_m of a barrier on the measured state, shape (T − m,); NaN where it would compare two feet or two bounds."""
    order = len(use.class_k)
    psi = psi_along(log["h"][:, use.column], use.class_k)[-1]
    for time in use.changed:
        before, after = log.time[: len(psi)] < time - _SAME, log.time[order:] >= time - _SAME
        psi[before & after] = np.nan
    if use.seen_anew and len(psi):
        steps = log.element("gait_phase", "step")
        psi[steps[: len(psi)] != steps[order:]] = np.nan
    return psi


def violated(h: Array, magnitude: float) -> NDArray[np.bool_]:
    """Whether h is below 0 by more than rounding, 1e-9 of the bound's magnitude, or no number, shape of h."""
    return ~(h >= -_ROUNDING * magnitude)


def bound_along(log: RunLog, scenario: Scenario, use: BarrierUse) -> Array:
    """V̄(k) at each row, (T,) [unit of h]: the first of its samples over the horizon; NaN where there is none."""
    samples = log["barrier_bound"]
    bound = np.asarray(samples[:, use.column * (samples.shape[1] // len(scenario.barriers))])
    if not use.changed or use.quantity is None:
        return bound
    return np.where(np.abs(bound) < use.quantity.largest, bound, np.nan)


def h_along(log: RunLog, scenario: Scenario, use: BarrierUse) -> Array:
    """h at each row, (T,) [its unit]; NaN while a barrier that is changed as the walk goes on is not kept."""
    h = np.asarray(log["h"][:, use.column])
    return np.where(np.isnan(bound_along(log, scenario, use)), np.nan, h) if use.changed else h
