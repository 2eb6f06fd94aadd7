"""The part of a quadratic program's cost that no decision changes."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.mpc.affine_map import AffineMap


class QuadraticForm:
    """V(θ) = ½ θᵀR θ + rᵀθ + c, evaluated on the few coefficients that are not zero.

    Attributes:
        constant: c.
    """

    def __init__(self, matrix: np.ndarray, vector: np.ndarray, constant: float) -> None:
        self.constant = float(constant)
        self._used = np.flatnonzero(matrix.any(axis=1) | (vector != 0.0)).astype(np.int32)
        self._slope = AffineMap(vector[self._used], 0.5 * matrix[self._used]).arrays

    def __call__(self, theta: np.ndarray) -> float:
        """V(θ)."""
        if not len(self._used):
            return self.constant
        return self.constant + float(_value(self._used, *self._slope, theta))


@compiled
def _value(
    used: np.ndarray, vector: np.ndarray, starts: np.ndarray, columns: np.ndarray, values: np.ndarray,
    theta: np.ndarray,
) -> float:  # fmt: skip
    """Σ θ_i (r_i + ½ Σ R_ij θ_j) over the parameters i that show."""
    total = 0.0
    for i in range(len(used)):
        slope = vector[i]
        for k in range(starts[i], starts[i + 1]):
            slope += values[k] * theta[columns[k]]
        total += theta[used[i]] * slope
    return total
