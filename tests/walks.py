"""Walks on the template for the tests of the controller."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier, Linear, constant
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.memory_layout import MemoryLayout
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
    return Memory.standing(mpc)


def predicted(mpc: PeriodicMpc, state: np.ndarray, plan: Plan) -> np.ndarray:
    """[c, v, p] at k … k + H per axis under the plan's inputs, shape (2, H + 1, 3)."""
    phi, gamma = mpc.vhip.prediction(plan.tick, mpc.config.horizon)
    return np.array([phi @ state[axis] + gamma @ plan.inputs[axis] for axis in (0, 1)])


def walk(mpc: PeriodicMpc, ticks: int, memory: Memory | None = None, kick: dict[int, np.ndarray] | None = None):
    """Yields (tick, state, stance, plan) of the closed loop on the template, kicked after the given ticks.

    A memory that is given is moved on with the walk.
    """
    memory = memory or start(mpc)
    first = 0 if memory.plan is None else memory.plan.tick + 1
    kicks = np.array([(kick or {}).get(tick - 1, np.zeros(2)) for tick in range(first, first + ticks)])
    for row in walk_template(mpc, memory.copy(), first, ticks, kicks):
        yield row.tick, row.state, row.before.stance, row.plan
        vars(memory).update(vars(row.memory))


def repacked(mpc: PeriodicMpc, memory: Memory) -> Memory:
    """The memory after a round trip through its vector."""
    layout = MemoryLayout(mpc)
    return layout.unpack(layout.pack(memory))
