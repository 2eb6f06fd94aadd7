"""The periodic MPC on its own template, tick by tick, with events that a scenario can't describe.

The same loop as the block diagram's (`Memory` advances it), without Drake's framework around it: experiments need
thousands of short walks that begin in the middle of a step.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import Walk

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TemplateRecord:
    """T ticks of a walk; row i belongs to tick first + i.

    Attributes:
        first: tick of the first row.
        states: [c, v, p] per axis as the controller saw them, (T, 2, 3) [m, m/s, m].
        inputs: ZMP velocity applied, (T, 2) [m/s].
        stance: centre of this step's box, (T, 2) [m].
        slack: of the barrier rows, (T,) [m/s].
        reasons: `mpc.solution.Reason` of each tick, (T,).
        unplanned: ticks at which no solver had an answer, (T,).
        action: how far the barrier moved the forward ZMP velocity: |u − u of the same program without barriers,
            from the same state|, (T,) [m/s]; NaN where this was not asked for.
    """

    first: int
    states: Array
    inputs: Array
    stance: Array
    slack: Array
    reasons: NDArray[np.int_]
    unplanned: NDArray[np.bool_]
    action: Array

    @property
    def speed(self) -> Array:
        """Forward CoM velocity, (T,) [m/s]."""
        return np.asarray(self.states[:, 0, 1])


def standing(walk: Walk) -> Memory:
    """The controller's memory at tick 0, at rest between the feet."""
    return Memory.at_start(walk.mpc, np.zeros((2, 3)), walk.gait.feet_at_start)


def run_template(
    walk: Walk, memory: Memory, first: int, ticks: int, gains: Array | None = None, without: PeriodicMpc | None = None
) -> tuple[TemplateRecord, Memory]:
    """Walks on from `memory` (left as it is) for some ticks.

    Args:
        walk: gait, barriers and compiled program.
        memory: as it stands before tick `first`.
        gains: forward velocity that a disturbance adds before each tick, (≤ ticks,) [m/s].
        without: the same program without barriers, to tell when a barrier acts.

    Returns:
        the record, and the memory after the last tick.
    """
    memory = copy.deepcopy(memory)
    mpc, names = walk.mpc, walk.names
    bounds = {
        barrier.name: [barrier.bound.samples(k, mpc.config.horizon + 1) for k in range(barrier.period)]
        for barrier in walk.barriers
    }
    states, inputs, stance = np.empty((ticks, 2, 3)), np.empty((ticks, 2)), np.empty((ticks, 2))
    active = None
    reasons = np.zeros(ticks, dtype=int)
    slack, unplanned, action = np.empty(ticks), np.zeros(ticks, dtype=bool), np.full(ticks, np.nan)
    for i in range(ticks):
        k = first + i
        state = memory.state.copy()
        if gains is not None and i < len(gains):
            state[0, 1] += gains[i]
        samples = {name: bounds[name][k % len(bounds[name])] for _, name in names}
        plan = mpc.solve(k, state, memory.stance, samples, None, memory.plan)
        if without is not None:
            # The same problem less the barrier: the last plan's footholds, but an active set of its own.
            if active is None:
                active = without.solve(k, state, memory.stance, {}).active
            last = None if memory.plan is None else memory.plan._replace(active=active)
            free = without.solve(k, state, memory.stance, {}, None, last)
            active = free.active
            action[i] = abs(plan.inputs[0, 0] - free.inputs[0, 0])
        states[i], inputs[i], stance[i] = state, plan.inputs[:, 0], memory.stance[:, 1]
        slack[i], unplanned[i] = plan.slack, plan.fallbacks > 0
        reasons[i] = int(plan.reason)
        memory.advance(mpc, state, plan)
    return TemplateRecord(first, states, inputs, stance, slack, reasons, unplanned, action), memory
