"""The problems of closed-loop runs, recorded so that every route can be timed on the same ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.simulation.build import Walk

NOISE = 0.004  # standard deviation of the change of the CoM velocity at every tick [m/s]
KICK = 0.04  # a sudden change of the CoM velocity [m/s]
KICK_EVERY = 97  # [ticks]: no multiple of a step, so that kicks meet all phases


class Tick(NamedTuple):
    """The arguments of `PeriodicMpc.solve` at tick k."""

    tick: int
    state: np.ndarray
    stance: np.ndarray
    bounds: dict[str, np.ndarray]
    last: Plan | None


class Recording(NamedTuple):
    """The ticks of one run, and the reason of each plan (`mpc.plan.Reason`)."""

    ticks: list[Tick]
    reasons: np.ndarray


def record(walk: Walk, count: int, perturbed: bool, seed: int = 0) -> Recording:
    """Walks the template for `count` ticks in the steady state of the walk.

    Perturbed means that the velocity changes by noise at every tick, and by a kick about once a second.
    """
    start = (walk.gait.config.start_steps + 2) * walk.gait.period
    kicks = np.zeros((start + count, 2))
    random = np.random.default_rng(seed)
    for k in range(start, start + count if perturbed else start):
        kicks[k] = NOISE * random.standard_normal(2)
        if k % KICK_EVERY == 0:
            kicks[k] += KICK * random.choice([-1.0, 1.0], 2)
    ticks, reasons = [], []
    for row in walk_template(walk.mpc, Memory.standing(walk.mpc), 0, start + count, kicks):
        if row.tick >= start:
            bounds = walk.mpc.bounds(row.tick)
            ticks.append(Tick(row.tick, row.state, row.before.stance, bounds, row.before.plan))
            reasons.append(row.plan.reason)
    return Recording(ticks, np.array(reasons, dtype=int))


def solve(mpc: PeriodicMpc, given: Tick) -> Plan:
    """Our route: from the measured state to the plan, both axes."""
    return mpc.solve(given.tick, given.state, given.stance, given.bounds, None, given.last)


def theta(mpc: PeriodicMpc, given: Tick, axis: int) -> np.ndarray:
    """The parameters of one axis at that tick."""
    tick = mpc.given(given.tick, given.state, given.stance, given.bounds, None, given.last)
    return mpc.problems[axis].theta(tick)
