"""Small dense linear algebra and joint arithmetic of one posture, as machine code."""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.jit import compiled


@compiled
def factorize(matrix: np.ndarray, pivots: np.ndarray) -> bool:
    """Overwrites a matrix (n, n) with its LU factors; false where it is singular.

    Row k has been exchanged with row pivots[k], shape (n,), whole numbers.
    """
    n = len(matrix)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivots[k] = best
        if not abs(matrix[best, k]) > 0.0:  # zero, or no number
            return False
        if best != k:
            for j in range(n):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            matrix[i, k] = factor
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
    return True


@compiled
def substitute(factors: np.ndarray, pivots: np.ndarray, right: np.ndarray, x: np.ndarray) -> None:
    """Writes the solution x (n,) for a right-hand side (n,), from what `factorize` made."""
    n = len(factors)
    for k in range(n):
        x[k] = right[k]
    for k in range(n):
        x[k], x[pivots[k]] = x[pivots[k]], x[k]
    for i in range(n):
        for j in range(i):
            x[i] -= factors[i, j] * x[j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= factors[i, j] * x[j]
        x[i] /= factors[i, i]


@compiled
def move_along(q: np.ndarray, step: np.ndarray, quaternion: np.ndarray, out: np.ndarray) -> None:
    """Writes q + step, all (n_q,), with its quaternion (at these four places in q) normalized."""
    for i in range(len(q)):
        out[i] = q[i] + step[i]
    square = 0.0
    for place in quaternion:
        square += out[place] * out[place]
    for place in quaternion:
        out[place] /= math.sqrt(square)


@compiled
def within_limits(
    q: np.ndarray, joints: np.ndarray, lower: np.ndarray, upper: np.ndarray, quaternion: np.ndarray
) -> bool:
    """Whether every joint of q (n_q,) is within its limits and the quaternion has length one; NaN is not.

    The joints' places in q and their limits [rad] have shape (n,), the quaternion's places (4,).
    """
    for i in range(len(joints)):
        if not (q[joints[i]] >= lower[i] and q[joints[i]] <= upper[i]):
            return False
    square = 0.0
    for place in quaternion:
        square += q[place] * q[place]
    return abs(square - 1.0) < 1e-12


@compiled
def limit(vector: np.ndarray, places: np.ndarray, most: np.ndarray) -> None:
    """Keeps the entries at these places of a vector within ± most, shape of the places; NaN stays."""
    for i in range(len(places)):
        value = vector[places[i]]
        if abs(value) > most[i]:
            vector[places[i]] = math.copysign(most[i], value)


@compiled
def largest(vector: np.ndarray) -> float:
    """The largest magnitude of a vector (n,); NaN where it holds one."""
    most = 0.0
    for value in vector:
        if not abs(value) <= most:
            most = abs(value)
            if most != most:
                return most
    return most
