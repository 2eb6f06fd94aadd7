"""The part of a quadratic program's cost that no decision changes."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.jit import compiled

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
        return quadratic_value(*self.arrays, theta)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """What `quadratic_value` needs: the parameters that show, R and r for them, c."""
        return self._used, self._matrix, self._vector, self.constant

    def plus(self, matrix: np.ndarray, vector: np.ndarray, constant: float) -> QuadraticForm:
        """The sum with another form; coefficients that cancel up to rounding are taken to be zero."""
        R, r = self.matrix, self.vector
        used = np.flatnonzero(R.any(axis=1) | matrix.any(axis=1) | (r != 0.0) | (vector != 0.0))
        block = np.ix_(used, used)
        R[block] = _sum(R[block], matrix[block])
        r[used] = _sum(r[used], vector[used])
        return QuadraticForm(R, r, self.constant + constant)

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


@compiled
def quadratic_value(
    used: np.ndarray, matrix: np.ndarray, vector: np.ndarray, constant: float, theta: np.ndarray
) -> float:
    """½ tᵀR t + rᵀt + c with t = θ[used]."""
    total = constant
    for i in range(len(used)):
        slope = vector[i]
        for j in range(len(used)):
            slope += 0.5 * matrix[i, j] * theta[used[j]]
        total += theta[used[i]] * slope
    return total


def _sum(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    total: np.ndarray = a + b
    total[np.abs(total) <= _NOISE * (np.abs(a) + np.abs(b))] = 0.0
    return total
