"""The arithmetic of a tick's quadratic program, as machine code; see `daqp_solver.DaqpQp`."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from pdhocbf_drake.jit import compiled

Sparse: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray]
"""A matrix in compressed rows: starts, columns, values; row i is values[starts[i] : starts[i + 1]] in these columns."""

Affine: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""An affine map: its offset, then its matrix as in `Sparse`."""


Quadratic: TypeAlias = tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""A `QuadraticForm`: its constant, the parameters that show, and the affine map to half their slopes."""


@compiled
def write_affine(
    offset: np.ndarray, starts: np.ndarray, columns: np.ndarray, values: np.ndarray, theta: np.ndarray, out: np.ndarray
) -> None:
    """Writes offset + M θ into `out`."""
    for row in range(len(offset)):
        total = offset[row]
        for k in range(starts[row], starts[row + 1]):
            total += values[k] * theta[columns[k]]
        out[row] = total


@compiled
def quadratic(form: Quadratic, theta: np.ndarray) -> float:
    """c + Σ θ_i (r_i + ½ Σ R_ij θ_j) over the parameters i that show."""
    constant, used, vector, starts, columns, values = form
    total = constant
    for i in range(len(used)):
        slope = vector[i]
        for k in range(starts[i], starts[i + 1]):
            slope += values[k] * theta[columns[k]]
        total += theta[used[i]] * slope
    return total


@compiled
def is_finite(vector: np.ndarray) -> bool:
    """Whether every entry is a finite number."""
    total = 0.0
    for value in vector:
        total += value - value  # NaN where it is not
    return total == 0.0


@compiled
def write_senses(guess: np.ndarray, source: np.ndarray, cold: np.ndarray, out: np.ndarray) -> None:
    """Flags +1 upper, −1 lower, 0 inactive of the rows `source`, as DAQP wants them beside what rows always are."""
    for row in range(len(cold)):
        flag = guess[source[row]]
        out[row] = cold[row]
        if cold[row] != 5:  # an equality is always active
            out[row] |= 1 if flag > 0.0 else 3 if flag < 0.0 else 0


@compiled
def write_limits(
    gradient: Affine, own: Affine, root: Sparse, rows: Sparse, unchanged: Quadratic, theta: np.ndarray,
    optimum: np.ndarray, limits: np.ndarray,
) -> float:  # fmt: skip
    """y° = −(L Lᵀ)⁻¹ g(θ), and the rows' own bounds less what the rows are at y°; gives the cost at w°: what
    no decision changes − ½ |L⁻¹ g|².
    """
    starts, columns, values = root
    write_affine(gradient[0], gradient[1], gradient[2], gradient[3], theta, optimum)
    least, n, m = quadratic(unchanged, theta), len(optimum), len(limits) // 2
    for i in range(n):
        last = starts[i + 1] - 1  # the diagonal
        total = -optimum[i]
        for k in range(starts[i], last):
            total -= values[k] * optimum[columns[k]]
        optimum[i] = total / values[last]
        least -= 0.5 * optimum[i] * optimum[i]
    for i in range(n - 1, -1, -1):
        last = starts[i + 1] - 1
        optimum[i] /= values[last]
        for k in range(starts[i], last):
            optimum[columns[k]] -= values[k] * optimum[i]
    write_affine(own[0], own[1], own[2], own[3], theta, limits)
    starts, columns, values = rows
    bounds = m - (len(starts) - 1)
    for i in range(m):
        at = optimum[i] if i < bounds else 0.0
        if i >= bounds:
            for k in range(starts[i - bounds], starts[i - bounds + 1]):
                at += values[k] * optimum[columns[k]]
        limits[i] -= at
        limits[m + i] -= at
    return least


@compiled
def write_decisions(
    root: Sparse, back: Sparse, hard: np.ndarray, order: np.ndarray, optimum: np.ndarray, y: np.ndarray,
    multipliers: np.ndarray, decisions: np.ndarray, active: np.ndarray, product: np.ndarray,
) -> float:  # fmt: skip
    """Fills in w = M⁻¹ (y° + y), the flags of the rows and Lᵀ y; gives what y costs: ½ |Lᵀ y|²."""
    starts, columns, values = back
    for i in range(len(hard)):
        total = 0.0
        for k in range(starts[i], starts[i + 1]):
            total += values[k] * (optimum[columns[k]] + y[columns[k]])
        decisions[hard[i]] = total
    for row in range(len(order)):
        if multipliers[row] != 0.0:
            active[order[row]] = 1.0 if multipliers[row] > 0.0 else -1.0
    starts, columns, values = root
    for i in range(len(product)):
        product[i] = 0.0
    for i in range(len(y)):
        for k in range(starts[i], starts[i + 1]):
            product[columns[k]] += values[k] * y[i]
    cost = 0.0
    for value in product:
        cost += 0.5 * value * value
    return cost
