"""Notes on bounds that a scenario gives as numbers: beyond the nominal walk, repeated early, or constant."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pdhocbf_drake.barriers import make_bound
from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.simulation.build import nominal_walk_of
from pdhocbf_drake.simulation.commands import commanded_gait, goes_ahead, known_ground
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.walking.vhip import Vhip

_ROUNDING = 1e-6  # of the largest value


def notes_on_bounds(scenario: Scenario) -> Iterator[str]:
    """A sentence on each table that repeats within a step, on each harmonic without a wave, and on each bound that the
    nominal walk exceeds.
    """
    gait, nominal = scenario.gait, None
    for name, config in scenario.barriers.items():
        bound = config.bound
        if bound.follows_orbit:
            continue
        count, step = len(bound.values or ()), gait.ticks_per_step
        if bound.kind == "tabulated" and count not in (step, gait.ticks_per_gait):
            yield f"barriers.{name}.bound.values: the table repeats every {count} ticks; a step has {step} ticks"
        if bound.kind == "harmonic" and not (bound.cosine or bound.sine):
            constant = f"is constant, {bound.mean:g} {config.unit}"
            yield f"barriers.{name}.bound: a harmonic with neither cosine nor sine {constant}"
        if not goes_ahead(scenario) or known_ground(scenario) is not None:
            continue
        quantity, length = config.bounded, gait.ticks_per_gait
        try:
            vhip = Vhip(commanded_gait(scenario).eta(), gait.tick)
            nominal = nominal_walk_of(scenario, gait.stride) if nominal is None else nominal
            period = length if count == length else quantity.period(vhip.period)
            values = np.resize(make_bound(bound, period, None, config.side).values, length)
        except PdhocbfError:  # the walk is refused for it when it is built
            continue
        orbit = quantity.orbit(nominal, vhip, gait, config.side)
        if orbit is None:
            continue
        beyond = (np.resize(orbit, length) - values) * (1.0 if config.side == "upper" else -1.0)
        outside = beyond > _ROUNDING * np.abs([*values, *orbit]).max()
        if outside.any():
            yield (
                f"barriers.{name}: the nominal walk is beyond this bound at {outside.sum()} of {length} ticks, "
                f"by {beyond.max():.3g} {config.unit} at most, so that h ≥ 0 asks for another walk than the commanded"
            )
