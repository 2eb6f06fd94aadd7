"""Walks on the template for the tests of the controller."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier, Linear, constant
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.walking import Gait, GaitConfig
from pdhocbf_drake.walking.vhip import Vhip


def make_mpc(gait: dict | None = None, mpc: dict | None = None, barriers: tuple = ()) -> PeriodicMpc:
    walk = Gait(GaitConfig(**(gait or {})))
    vhip = Vhip(walk.height.eta(), walk.config.tick)
    return PeriodicMpc(walk, vhip, MpcConfig(**(mpc or {})), (list(barriers), []))


def speed_limit(value: float, gammas: tuple[float, ...] = (0.5, 0.5)) -> AffineBarrier:
    return AffineBarrier("limit", [0.0, 1.0, 0.0], constant(value), 1, [Linear(g) for g in gammas], "m/s")


def start(mpc: PeriodicMpc) -> Memory:
    return Memory.at_start(mpc, np.zeros((2, 3)), mpc.gait.feet_at_start)


def predicted(mpc: PeriodicMpc, state: np.ndarray, plan: Plan) -> np.ndarray:
    """[c, v, p] at k … k + H per axis under the plan's inputs, shape (2, H + 1, 3)."""
    phi, gamma = mpc.vhip.prediction(plan.tick, mpc.config.horizon)
    return np.array([phi @ state[axis] + gamma @ plan.inputs[axis] for axis in (0, 1)])


def walk(mpc: PeriodicMpc, ticks: int, memory: Memory | None = None, kick: dict[int, np.ndarray] | None = None):
    """Yields (tick, state, stance, plan) of the closed loop on the template."""
    memory = memory or start(mpc)
    first = 0 if memory.plan is None else memory.plan.tick + 1
    for tick in range(first, first + ticks):
        state, stance = memory.state.copy(), memory.stance.copy()
        bounds = {b.name: b.bound.samples(tick, mpc.config.horizon + 1) for group in mpc.barriers for b in group}
        plan: Plan = mpc.solve(tick, state, stance, bounds, None, memory.plan)
        yield tick, state, stance, plan
        memory.advance(mpc, state, plan)
        if kick and tick in kick:
            memory.state[:, 1] += kick[tick]
