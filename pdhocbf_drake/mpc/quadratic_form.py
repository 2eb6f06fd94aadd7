"""The part of a quadratic program's cost that no decision changes."""

from __future__ import annotations

import numpy as np

_NOISE = 1e-12  # coefficients below this part of what they are the difference of are rounding


class QuadraticForm:
    """V(θ) = ½ θᵀR θ + rᵀθ + c, evaluated on the few parameters that show in it.

    Attributes:
        matrix: R, shape (n_θ, n_θ). vector: r, shape (n_θ,). constant: c.
    """

    def __init__(self, matrix: np.ndarray, vector: np.ndarray, constant: float) -> None:
        self._size, self.constant = len(vector), float(constant)
        self._used = np.flatnonzero(matrix.any(axis=1) | (vector != 0.0))
        self._matrix, self._vector = matrix[np.ix_(self._used, self._used)], vector[self._used]

    def __call__(self, theta: np.ndarray) -> float:
        """V(θ)."""
        if not len(self._used):
            return self.constant
        t = theta[self._used]
        return float(t @ (0.5 * (self._matrix @ t) + self._vector) + self.constant)

    def plus(self, matrix: np.ndarray, vector: np.ndarray, constant: float) -> QuadraticForm:
        """The sum with another form; coefficients that cancel up to rounding are taken to be zero."""
        R, r = self.matrix, self.vector
        R_sum, r_sum = R + matrix, r + vector
        R_sum[np.abs(R_sum) <= _NOISE * (np.abs(R) + np.abs(matrix))] = 0.0
        r_sum[np.abs(r_sum) <= _NOISE * (np.abs(r) + np.abs(vector))] = 0.0
        return QuadraticForm(R_sum, r_sum, self.constant + constant)

    @property
    def matrix(self) -> np.ndarray:
        R = np.zeros((self._size, self._size))
        R[np.ix_(self._used, self._used)] = self._matrix
        return R

    @property
    def vector(self) -> np.ndarray:
        r = np.zeros(self._size)
        r[self._used] = self._vector
        return r
