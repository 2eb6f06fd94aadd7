"""The problems of closed-loop runs, recorded so that every route can be timed on the same ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.simulation.build import Walk

NOISE = 0.004  # of the measured CoM velocity, at every tick [m/s]
KICK = 0.04  # a sudden change of the CoM velocity [m/s]
KICK_EVERY = 97  # [ticks]: no multiple of a step, so that kicks meet all phases


class Tick(NamedTuple):
    """What the controller was given at tick k; see `PeriodicMpc.solve`."""

    tick: int
    state: np.ndarray
    stance: np.ndarray
    bounds: dict[str, np.ndarray]
    last: Plan | None


class Recording(NamedTuple):
    """The ticks of one run, and for each why its plan is what it is (`mpc.solution.Reason`)."""

    ticks: list[Tick]
    reasons: np.ndarray


def record(walk: Walk, count: int, perturbed: bool, seed: int = 0) -> Recording:
    """Walks the template for `count` ticks in the steady state of the walk.

    Perturbed means that every velocity is measured with noise, and that the CoM is kicked about once a second.
    """
    mpc = walk.mpc
    memory = Memory.at_start(mpc, np.zeros((2, 3)), walk.gait.feet_at_start)
    random = np.random.default_rng(seed)
    start = (walk.gait.config.start_steps + 2) * walk.gait.period
    ticks, reasons = [], []
    for k in range(start + count):
        state = memory.state.copy()
        if perturbed and k >= start:
            state[:, 1] += NOISE * random.standard_normal(2)
            if k % KICK_EVERY == 0:
                state[:, 1] += KICK * random.choice([-1.0, 1.0], 2)
        bounds = bounds_at(walk, k)
        given = Tick(k, state, memory.stance.copy(), bounds, memory.plan)
        plan = solve(mpc, given)
        memory.advance(mpc, state, plan)
        if k >= start:
            ticks.append(given)
            reasons.append(plan.reason)
    return Recording(ticks, np.array(reasons, dtype=int))


def solve(mpc: PeriodicMpc, given: Tick) -> Plan:
    """Our route: from the measured state to the plan, both axes."""
    return mpc.solve(given.tick, given.state, given.stance, given.bounds, None, given.last)


def theta(mpc: PeriodicMpc, given: Tick, axis: int) -> np.ndarray:
    """The parameters of one axis at that tick."""
    tick = mpc.given(given.tick, given.state, given.stance, given.bounds, None, given.last)
    return mpc.problems[axis].theta(tick)


def bounds_at(walk: Walk, tick: int) -> dict[str, np.ndarray]:
    """The samples of every barrier's bound over the horizon."""
    return {barrier.name: barrier.bound.samples(tick, walk.mpc.config.horizon + 1) for barrier in walk.barriers}
