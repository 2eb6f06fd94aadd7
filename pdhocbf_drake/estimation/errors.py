"""Errors of an estimate whose truth is known, and their normalized square (NEES)."""

from __future__ import annotations

from typing import Final

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RotationMatrix

from pdhocbf_drake.estimation.kernels import DP, DSOLES, DV, ERRORS, PHI, SOLES, P, R, V, write_log
from pdhocbf_drake.estimation.memory import Memory

OBSERVED: Final = 8
"""Errors that can be observed: tilt (2), velocity (3), base from the stance foot (3)."""


def write_errors(memory: Memory, base: np.ndarray, velocity: np.ndarray, soles: np.ndarray, out: np.ndarray) -> None:
    """The invariant errors [φ_x, φ_y, δv, δp − δd] with the stance foot's d, and eᵀ P⁻¹ e, (9,) [rad, m/s, m, 1].

    With φ = log(R̂ Rᵀ), δv = v̂ − exp(φ) v, and likewise for places: yaw and place in the world, which can't be
    observed, are not among them. For an estimate that is as certain as it says, the last one is χ² of eight degrees.

    Args:
        base: true quaternion wxyz and position of the base (7,). velocity: its velocity (3,) [m/s].
        soles: places of both soles (2, 3) [m].
    """
    estimate, side = memory.estimate, int(memory.anchor[0])
    length = max(float(np.linalg.norm(base[:4])), 1e-12)
    true = RotationMatrix(Quaternion(base[:4] / length)).matrix()
    turn, phi = estimate[R : R + 9].reshape(3, 3) @ true.T, np.empty(3)
    write_log(turn.ravel(), phi)
    sole = estimate[SOLES + 3 * side : SOLES + 3 * side + 3]
    out[:2] = phi[:2]
    out[2:5] = estimate[V : V + 3] - turn @ velocity
    out[5:8] = estimate[P : P + 3] - sole - turn @ (base[4:] - soles[side])
    rows = np.zeros((OBSERVED, ERRORS))
    for row, column in enumerate((PHI, PHI + 1, DV, DV + 1, DV + 2, DP, DP + 1, DP + 2)):
        rows[row, column] = 1.0
    for axis in range(3):
        rows[5 + axis, DSOLES + 3 * side + axis] = -1.0
    if not memory.covariance.any():
        out[8] = 0.0  # an estimator without a covariance
        return
    try:
        out[8] = out[:8] @ np.linalg.solve(rows @ memory.covariance @ rows.T, out[:8])
    except np.linalg.LinAlgError:
        out[8] = np.inf
