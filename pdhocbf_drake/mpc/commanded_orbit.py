"""The settled walk of the template under a constant command, found step by step."""

from __future__ import annotations

from collections.abc import Generator, Iterator

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.orbit import Recurrence, check_planned
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.sides import LEFT

Array = NDArray[np.float64]

_CLOSE = 2e-6  # how far a gait may miss its start [m]
_AHEAD = 8  # steps of which the divergent component at the start is made
_FARTHEST = 0.01  # from a gait's end to the next start [m]


def settling(mpc: PeriodicMpc) -> Iterator[Array | None]:
    """c, v, p over a step on the left and one on the right foot of the settled walk; None after each step before.

    c and p are from the stance foot, all along its heading, shape (2 feet, 2 axes, N, 3).

    Without barriers a plan depends on c and v by ξ = c + v/ω_k alone. So a gait is the map G of its start z, which is
    ξ, p and the boxes of the last and this step from the commanded foothold and along its heading, and the settled walk
    is its fixed point, to which a secant method leads. Then in Euler's c(k+1) = (1 − δω_k) c(k) + δω_k ξ(k) the c(0) is
    found at which c repeats, too.

    Raises:
        InputError: the walk can't be planned, or does not settle.
    """
    first = mpc.gait.config.start_steps + 2  # the step before it is on a foot, too
    step = first + first % 2
    start, recurrence = _in_the_middle(mpc, step), Recurrence(mpc, _CLOSE, "m")
    before: tuple[Array, Array] | None = None
    while True:
        states, end, com = yield from _walked(mpc, step, start)
        way = end - start
        missed = float(np.abs(way).max())
        if recurrence.reached(missed, missed):
            break
        start, before = end if before is None else _extrapolated(end, way, *before), (end, way)
    steps = np.split(_repeated(mpc, step, states, com), 2, axis=1)
    yield np.stack(steps if mpc.gait.support(step) == LEFT else steps[::-1])


def _in_the_middle(mpc: PeriodicMpc, step: int) -> Array:
    """The start of step j of a walk on the commanded footholds with the ZMP in the middle of its box, (2, 4)."""
    gait, count = mpc.gait, _AHEAD * mpc.gait.period
    stances = np.array([gait.foothold(step + i) for i in range(-1, _AHEAD + 2)]).T
    zmp = np.stack([gait.region.centres(axis, count + 1) for axis in stances])
    away = np.diff(zmp, axis=1) @ mpc.divergent.input_weights(0, count) / gait.config.tick
    return _seen(mpc, step, np.column_stack([zmp[:, 0] + away, zmp[:, 0], stances[:, :2]]))


def _walked(mpc: PeriodicMpc, step: int, start: Array) -> Generator[None, None, tuple[Array, Array, Array]]:
    """A gait from step j on: [c, v, p] of its ticks from their stance feet (2N, 2, 3), G(z), and c − f behind it, (2,).

    It begins with v = 0, and gives None after each of its steps.
    """
    gait = mpc.gait
    plan: Plan | None = None
    divergent, zmp, *boxes = (rotation(gait.step(step).yaw) @ start + gait.foothold(step)[:, None]).T
    state, stance = np.column_stack([divergent, np.zeros(2), zmp]), np.column_stack(boxes)
    states = np.empty((2, gait.period, 2, 3))
    for j in range(2):
        back = rotation(-gait.step(step + j).yaw)
        for q in range(gait.period):
            tick = (step + j) * gait.period + q
            plan = mpc.solve(tick, state, stance, {}, None, plan)
            check_planned(mpc, tick, plan)
            states[j, q] = back @ (state - stance[:, 1:] * [1.0, 0.0, 1.0])
            state, landing = mpc.vhip.step_axes(tick, state, plan.inputs[:, 0]), plan.footholds[:, 0]
        stance = np.column_stack([stance[:, 1], landing])
        yield
    c, v, p = state.T
    end = _seen(mpc, step + 2, np.column_stack([c + v / mpc.divergent.omega[0], p, stance]))
    com = rotation(-gait.step(step + 2).yaw) @ (c - stance[:, 1])
    return states.reshape(-1, 2, 3), end, com


def _seen(mpc: PeriodicMpc, step: int, points: Array) -> Array:
    """Points (2, n) from the commanded foothold of step j and along its heading."""
    return np.asarray(rotation(-mpc.gait.step(step).yaw) @ (points - mpc.gait.foothold(step)[:, None]))


def _extrapolated(end: Array, way: Array, end_before: Array, way_before: Array) -> Array:
    """The next start by the secant method: what shrinks slowly, as under a slow turn, is gone in one gait.

    Where a way is longer than the one before it, or as long, it is the end of the gait.

    Args:
        end, way: G(z) and G(z) − z, and those of the gait before.
    """
    change = way - way_before
    if not change.any() or np.abs(way).max() > np.abs(way_before).max():
        return end
    beyond = np.vdot(way, change) / np.vdot(change, change) * (end - end_before)
    return np.asarray(end - beyond * min(1.0, _FARTHEST / max(float(np.abs(beyond).max()), _FARTHEST)))


def _repeated(mpc: PeriodicMpc, step: int, states: Array, com: Array) -> Array:
    """The states of a gait from step j on with the c and v at which c repeats, shape (2, 2N, 3).

    Args:
        com: c at the end of the gait as it was walked, from the foot that stands then, (2,).
    """
    gait, omega = mpc.gait, np.tile(mpc.divergent.omega, 2)
    left = np.cumprod(np.concatenate([[1.0], 1.0 - gait.config.tick * omega]))  # of a change of c(0)
    yaw, second, last = (gait.step(step + i).yaw for i in range(3))
    change = np.linalg.solve(np.eye(2) - left[-1] * rotation(yaw - last), com - states[0, :, 0])
    changes = left[:-1, None] * np.repeat([change, rotation(yaw - second) @ change], gait.period, axis=0)
    states[:, :, 0] += changes
    states[:, :, 1] -= omega[:, None] * changes
    return states.swapaxes(0, 1)
