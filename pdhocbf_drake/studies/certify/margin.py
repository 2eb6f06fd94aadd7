"""The margin of a bound that belongs to an `mpc.robust`."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.mpc.config import RobustConfig
from pdhocbf_drake.mpc.robust import nearer_bound, zmp_margin
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.sensed import sensed
from pdhocbf_drake.studies.certify.design import Envelope
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig
from pdhocbf_drake.walking.vhip import Vhip


def with_robust(scenario: Scenario, robust: RobustConfig | None) -> Scenario:
    """The scenario whose MPC is tightened so."""
    return scenario.model_copy(update={"mpc": scenario.mpc.model_copy(update={"robust": robust})})


def plain(scenario: Scenario) -> Scenario:
    """The scenario whose bounds are as they are written; what `mpc.robust` takes from its ZMP box stays off it."""
    if scenario.mpc.robust is None:
        return scenario
    vhip = Vhip(Gait(scenario.gait).eta(), scenario.gait.tick)
    mpc = scenario.mpc.model_copy(update={"robust": None, "zmp_margin": zmp_margin(vhip, sensed(scenario))})
    return scenario.model_copy(update={"mpc": mpc})


def margin_for(scenario: Scenario, barrier: WalkBarrierConfig, envelope: Envelope) -> tuple[Array, Array]:
    """t(k) of (R4) in docs/robust.md for the scenario's `mpc.robust`, and the nominal orbit.

    A bound this far from the orbit leaves it to the plans of a controller with this `mpc.robust`.

    Args:
        barrier: whose bound is the orbit itself.

    Returns:
        Both over one period of the bound, (period,) [unit of h].
    """
    walk = build_walk(with_robust(scenario, None).model_copy(update={"barriers": {"bound": barrier}}))
    made = next(barrier for axis in walk.mpc.barriers for barrier in axis)
    nearer = nearer_bound(made, walk.vhip, sensed(scenario), envelope.quantity.axis)
    period = len(envelope.mean)
    orbit = made.bound.samples(0, period)
    if nearer is None:
        return np.zeros(period), orbit
    return np.max([nearer[start : start + period] for start in range(0, len(nearer), period)], axis=0), orbit
