"""The nominal periodic orbit of the template under the periodic MPC without barriers."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.gait import Gait
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.memory import Memory

_RECURRENCE = 1e-9  # [m/s]
_GAITS = 60


def nominal_orbit(gait: Gait, mpc: PeriodicMpc) -> np.ndarray:
    """CoM velocity over one gait in the steady state of the walk, x and y, shape (2, 2N) [m/s].

    Walks the template from its standing start until a gait repeats the one before.

    Raises:
        InputError: the walk has barriers or an end, or doesn't settle.
    """
    if any(mpc.barriers) or gait.config.walk_steps is not None:
        raise InputError("the nominal orbit is that of a walk without barriers and without an end")
    half = gait.config.stance_width / 2.0
    memory = Memory.at_start(mpc, np.zeros((2, 3)), np.array([[0.0, half], [0.0, -half]]))
    cycle = gait.config.ticks_per_gait
    start = gait.config.start_steps * gait.period
    start += start % cycle
    before = np.full((2, cycle), np.inf)
    for tick in range(start):
        _advance(mpc, memory, tick)
    for gaits in range(_GAITS):
        velocity = np.empty((2, cycle))
        for i in range(cycle):
            velocity[:, i] = memory.state[:, 1]
            _advance(mpc, memory, start + gaits * cycle + i)
        if np.abs(velocity - before).max() < _RECURRENCE:
            return velocity
        before = velocity
    raise InputError(f"gait: the walk did not settle into a periodic orbit within {_GAITS} gaits")


def _advance(mpc: PeriodicMpc, memory: Memory, tick: int) -> None:
    plan = mpc.solve(tick, memory.state, memory.stance, {}, None, memory.plan)
    if plan.fallbacks:
        raise InputError(f"gait: the walk can't be planned: {plan.reason.name.lower()} at tick {tick}")
    memory.advance(mpc, memory.state, plan)
