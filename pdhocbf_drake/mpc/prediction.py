"""What was measured d ticks ago, carried forward with the ZMP velocities sent since (Artstein's predictor)."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.walking.vhip import Vhip


@compiled
def carry_forward(A: np.ndarray, B: np.ndarray, tick: int, sent: np.ndarray, state: np.ndarray) -> None:
    """Moves a state of tick k − d on to tick k, in place: s(j + 1) = A(j) s(j) + B(j) u(j).

    Args:
        A, B: of the template over one period, (N, 3, 3) and (N, 3).
        tick: k − d.
        sent: ZMP velocities u(k − d) … u(k − 1) of x and y, (2, d) [m/s].
        state: c, v, p of x, then of y, (2, 3) [m, m/s, m].
    """
    following = np.empty(3)
    for j in range(sent.shape[1]):
        phase = (tick + j) % len(A)
        for axis in range(2):
            for row in range(3):
                following[row] = B[phase, row] * sent[axis, j]
                for column in range(3):
                    following[row] += A[phase, row, column] * state[axis, column]
            for row in range(3):
                state[axis, row] = following[row]


def carried_back(vhip: Vhip, tick: int, sent: np.ndarray, state: np.ndarray) -> list[np.ndarray]:
    """The states of ticks k − d … k − 1, (2, 3) each, from which `sent` led to `state` at tick k."""
    before: list[np.ndarray] = []
    for back, zmp_velocity in enumerate(sent.T[::-1], start=1):
        phase = (tick - back) % vhip.period
        state = np.linalg.solve(vhip.A[phase], (state - np.outer(zmp_velocity, vhip.B[phase])).T).T
        before.insert(0, state)
    return before


def zmp_before(zmp: np.ndarray, sent: np.ndarray, tick: float) -> np.ndarray:
    """The planned ZMP (2,) d ticks before it was `zmp` (2,), after the velocities `sent` (2, d), δ = `tick` [s, m]."""
    return np.asarray(zmp - tick * sent.sum(axis=1))
