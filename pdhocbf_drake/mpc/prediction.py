"""What was measured d ticks ago, carried forward with the ZMP velocities sent since (Artstein's predictor).

`kernels.carry_forward` does so; what undoes it is here.
"""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.walking.vhip import Vhip


def carried_back(vhip: Vhip, tick: int, sent: np.ndarray, state: np.ndarray) -> list[np.ndarray]:
    """The states of ticks k − d … k − 1, (2, 3) each, from which `sent` led to `state` at tick k.

    As `kernels.carry_forward` does, in exact arithmetic.
    """
    before: list[np.ndarray] = []
    for back, zmp_velocity in enumerate(sent.T[::-1], start=1):
        phase = (tick - back) % vhip.period
        state = np.linalg.solve(vhip.A[phase], (state - np.outer(zmp_velocity, vhip.B[phase])).T).T
        before.insert(0, state)
    return before


def zmp_before(zmp: np.ndarray, sent: np.ndarray, tick: float) -> np.ndarray:
    """The planned ZMP (2,) d ticks before it was `zmp` (2,), after the velocities `sent` (2, d), δ = `tick` [s, m]."""
    return np.asarray(zmp - tick * sent.sum(axis=1))
