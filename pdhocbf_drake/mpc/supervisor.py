"""What surrounds a solve: which measurement to believe, and when to give up walking."""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.mpc.solution import Reason

_MOVED = 1e-6  # [m/s] or [m]: a prediction that changed by more, under a measurement that did not, makes it stale


def believed_state(
    mpc: PeriodicMpc, memory: Memory, measured: np.ndarray, tick: int, latency: float = 0.0
) -> tuple[np.ndarray, Reason]:
    """[c, v, p] to plan from, shape (2, 3), and whether the measurement was used.

    CoM position and velocity are the measured ones, the ZMP is the planned one (or, with Remark 8 to the letter, the
    measured one). A measurement that is not finite, or that repeats bit for bit while the plan moves on, is replaced
    by what the last plan predicts.

    What is planned from a measurement takes effect `latency` later [s]: the measured CoM is moved on over that time,
    c + τ v and v + τ eta(k) (c − p), or the robot would lag behind every plan by as much.
    """
    zmp_measured = mpc.config.zmp_state == "measured"
    eta = mpc.vhip.eta[tick % mpc.vhip.period]
    state, seen = np.empty((2, 3)), np.empty(4)
    finite, repeats, moves = _believed(memory.state, measured, memory.measured, zmp_measured, latency, eta, state, seen)
    if not finite:
        return memory.state, Reason.BAD_MEASUREMENT
    memory.measured = seen
    if repeats and moves > _MOVED:
        return memory.state, Reason.STALE_MEASUREMENT
    return state, Reason.SOLVED


@compiled
def _believed(
    planned: np.ndarray, measured: np.ndarray, before: np.ndarray, zmp_measured: bool, latency: float, eta: float,
    state: np.ndarray, seen: np.ndarray,
) -> tuple[bool, bool, float]:  # fmt: skip
    """Fills in the state `latency` after the measurement, and what was seen: c and v of both axes.

    Gives whether all is finite, whether it is what was seen before, and by how much it differs from the plan.
    """
    finite, repeats, moves = True, True, 0.0
    for axis in range(2):
        c, v = measured[axis, 0], measured[axis, 1]
        p = measured[axis, 2] if zmp_measured else planned[axis, 2]
        finite = finite and math.isfinite(c) and math.isfinite(v) and math.isfinite(p)
        repeats = repeats and c == before[2 * axis] and v == before[2 * axis + 1]
        moves = max(moves, abs(planned[axis, 0] - c), abs(planned[axis, 1] - v))
        seen[2 * axis], seen[2 * axis + 1] = c, v
        state[axis, 0], state[axis, 1], state[axis, 2] = c + latency * v, v + latency * eta * (c - p), p
    return finite, repeats, moves


def supervise(mpc: PeriodicMpc, memory: Memory, plan: Plan, measurement: Reason) -> Reason:
    """Counts degraded ticks, stops the walk after too many, and gives the reason to log for this tick.

    The stop takes one more step, then sets the feet side by side: `memory.last_step` tells clock and gait.
    """
    degraded = not plan.reason.planned or measurement != Reason.SOLVED
    memory.degraded = memory.degraded + 1 if degraded else 0
    if memory.degraded >= mpc.config.stop_ticks and memory.last_step < 0:
        memory.last_step = mpc.gait.phase(plan.tick)[0] + 1
    if not plan.reason.planned:
        return plan.reason
    if measurement != Reason.SOLVED:
        return measurement
    return Reason.STOPPING if memory.last_step >= 0 else plan.reason
