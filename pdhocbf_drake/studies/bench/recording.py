"""Problems of closed-loop runs, recorded so that every route is timed on the same ones, and the clock for that."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping, Sequence
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
AXES = (0, 1)
now = time.process_time
"""Processor time of this process [s].

On an idle machine it runs with the wall clock, since nothing here sleeps or uses a second thread. On a shared one it
leaves out the time of other processes, though not their effect on the caches: hence turns, medians and ratios.
"""


class Tick(NamedTuple):
    """The arguments of `PeriodicMpc.solve` at tick k."""

    tick: int
    state: np.ndarray
    stance: np.ndarray
    bounds: dict[str, np.ndarray]
    last: Plan | None

    def guess(self, axis: int) -> np.ndarray | None:
        """Active rows of the last plan on one axis; None without one."""
        return None if self.last is None else self.last.active[axis]


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


def time_routes(
    routes: Mapping[str, Callable[[Tick], float]],
    ticks: Sequence[Tick],
    passes: int,
    block: int,
    progress: Callable[[float], None] = lambda share: None,
) -> dict[str, np.ndarray]:
    """Seconds of each tick in each pass, by the route's name, shape (passes, ticks).

    The routes take turns after every `block` ticks (one step of the walk), each block once unclocked before the first
    pass. The garbage collector runs between them, where it does not slow one route for the objects of another.

    Args:
        routes: by name, the seconds that a tick takes.
        progress: called with the share that is done.
    """
    seconds = {name: np.empty((passes, len(ticks))) for name in routes}
    for spent in routes.values():
        for given in ticks[:block]:
            spent(given)
    for number in range(passes):
        for start in range(0, len(ticks), block):
            for name, spent in routes.items():
                gc.collect(0)
                gc.disable()
                try:
                    for i in range(start, min(start + block, len(ticks))):
                        seconds[name][number, i] = spent(ticks[i])
                finally:
                    gc.enable()
            progress((number * len(ticks) + start) / (passes * len(ticks)))
    return seconds


def typical(seconds: np.ndarray) -> np.ndarray:
    """The median of each tick over the passes, which a preempted pass does not move, shape (ticks,)."""
    return np.asarray(np.median(seconds, axis=0))
