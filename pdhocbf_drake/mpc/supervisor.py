"""What surrounds a solve: which measurement to believe, and when to give up walking."""

from __future__ import annotations

import numpy as np

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
    planned = memory.state
    state = planned.copy()
    state[:, :2] = measured[:, :2]
    if mpc.config.zmp_state == "measured":
        state[:, 2] = measured[:, 2]
    if not np.isfinite(state).all():
        return planned, Reason.BAD_MEASUREMENT
    seen = state[:, :2].ravel()
    repeats = bool((seen == memory.measured).all())
    memory.measured = seen
    if repeats and np.abs(planned[:, :2] - state[:, :2]).max() > _MOVED:
        return planned, Reason.STALE_MEASUREMENT
    if latency:
        eta = float(mpc.vhip.eta[tick % mpc.vhip.period])
        state = np.array([[c + latency * v, v + latency * eta * (c - p), p] for c, v, p in state.tolist()])
    return state, Reason.SOLVED


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
