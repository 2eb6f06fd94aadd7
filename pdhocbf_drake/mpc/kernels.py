"""The arithmetic of a tick outside of its quadratic program, as machine code."""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.jit import compiled


@compiled
def believe(
    planned: np.ndarray, measured: np.ndarray, before: np.ndarray, zmp_measured: bool, latency: float, eta: float,
    state: np.ndarray, com: np.ndarray,
) -> tuple[bool, bool, float]:  # fmt: skip
    """Fills in the state `latency` after the measurement, and the measured c and v of both axes.

    Gives whether all is finite, whether c and v equal those of `before`, and by how much they differ from the plan.
    """
    finite, repeats, moves = True, True, 0.0
    for axis in range(2):
        c, v = measured[axis, 0], measured[axis, 1]
        p = measured[axis, 2] if zmp_measured else planned[axis, 2]
        finite = finite and math.isfinite(c) and math.isfinite(v) and math.isfinite(p)
        repeats = repeats and c == before[2 * axis] and v == before[2 * axis + 1]
        moves = max(moves, abs(planned[axis, 0] - c), abs(planned[axis, 1] - v))
        com[2 * axis], com[2 * axis + 1] = c, v
        state[axis, 0], state[axis, 1], state[axis, 2] = c + latency * v, v + latency * eta * (c - p), p
    return finite, repeats, moves
