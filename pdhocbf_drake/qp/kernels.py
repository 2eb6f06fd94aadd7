"""The compiled loops of this room: sparse maps of θ, DAQP's vectors and the way back from them, merging of rows."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from pdhocbf_drake.jit import compiled

Sparse: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray]
"""A matrix in compressed rows: starts, columns, values. Row i has values[starts[i] : starts[i + 1]] in the columns
columns[starts[i] : starts[i + 1]]."""

Affine: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""The map offset + M θ: offset, then M as in `Sparse`."""

Quadratic: TypeAlias = tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""The form c + Σ θ_i (r_i + ½ Σ_j R_ij θ_j): c, the indices i that occur, then the map r + ½ R θ as in `Affine`."""

ACTIVE_UPPER, ACTIVE_LOWER, EQUALITY, SOFT = 1, 3, 5, 8
"""What DAQP calls the sense of a constraint; bits of one integer."""


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
def quadratic_value(form: Quadratic, theta: np.ndarray) -> float:
    """The value of a quadratic form at θ."""
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
        total += value - value  # NaN for an entry that is infinite or NaN
    return total == 0.0


@compiled
def write_senses(guess: np.ndarray, source: np.ndarray, cold: np.ndarray, out: np.ndarray) -> None:
    """Writes DAQP's senses for a guessed active set.

    Row i takes the flag guess[source[i]] (+1 active at its upper bound, −1 at its lower, 0 inactive) on top of its
    sense without a guess, cold[i]; an equality is active in any case.
    """
    for row in range(len(cold)):
        flag = guess[source[row]]
        out[row] = cold[row]
        if cold[row] != EQUALITY:
            out[row] |= ACTIVE_UPPER if flag > 0.0 else ACTIVE_LOWER if flag < 0.0 else 0


@compiled
def write_limits(
    gradient: Affine, bounds: Affine, root: Sparse, rows: Sparse, constant: Quadratic, theta: np.ndarray,
    optimum: np.ndarray, limits: np.ndarray,
) -> float:  # fmt: skip
    """Writes z° = −(L Lᵀ)⁻¹ g(θ) into `optimum` and [l(θ) − R z°, u(θ) − R z°] into `limits`; see `DaqpForm`.

    Args:
        gradient: g. bounds: l, then u, shape (2m,).
        root: L, the diagonal last in each row.
        rows: R without its first rows, which are those of the identity.
        constant: the part of the cost that depends on θ alone.

    Returns:
        The cost at z°: constant(θ) − ½ |L⁻¹ g|².
    """
    starts, columns, values = root
    write_affine(gradient[0], gradient[1], gradient[2], gradient[3], theta, optimum)
    least, n, m = quadratic_value(constant, theta), len(optimum), len(limits) // 2
    for i in range(n):  # −L⁻¹ g
        last = starts[i + 1] - 1
        total = -optimum[i]
        for k in range(starts[i], last):
            total -= values[k] * optimum[columns[k]]
        optimum[i] = total / values[last]
        least -= 0.5 * optimum[i] * optimum[i]
    for i in range(n - 1, -1, -1):  # times L⁻ᵀ
        last = starts[i + 1] - 1
        optimum[i] /= values[last]
        for k in range(starts[i], last):
            optimum[columns[k]] -= values[k] * optimum[i]
    write_affine(bounds[0], bounds[1], bounds[2], bounds[3], theta, limits)
    starts, columns, values = rows
    simple = m - (len(starts) - 1)
    for i in range(m):
        at = optimum[i] if i < simple else 0.0
        if i >= simple:
            for k in range(starts[i - simple], starts[i - simple + 1]):
                at += values[k] * optimum[columns[k]]
        limits[i] -= at
        limits[m + i] -= at
    return least


@compiled
def write_decisions(
    root: Sparse, inverse: Sparse, hard: np.ndarray, order: np.ndarray, optimum: np.ndarray, y: np.ndarray,
    multipliers: np.ndarray, decisions: np.ndarray, active: np.ndarray, product: np.ndarray,
) -> float:  # fmt: skip
    """Writes w = M⁻¹ (z° + y) into decisions[hard], and the signs of the multipliers into active[order].

    Args:
        root: L. inverse: M⁻¹.
        optimum: z°.
        product: work space, filled with Lᵀ y, shape (n,).

    Returns:
        The cost of y: ½ |Lᵀ y|².
    """
    starts, columns, values = inverse
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


@compiled
def merge_rows(group: np.ndarray, has_lower: np.ndarray, has_upper: np.ndarray, merged: np.ndarray) -> int:
    """Merges rows of one group whose bounds don't collide: each row joins the first that lacks the bounds it has.

    Args:
        group: a number of each row, equal for rows with equal coefficients.
        has_lower, has_upper: which of its bounds are finite.
        merged: written for each merged row: the row that it began with, and the rows that its lower and its upper
            bound come from (−1 for none), shape (number of rows, 3).

    Returns:
        The number of merged rows.
    """
    count = 0
    for i in range(len(group)):
        entry = 0
        while entry < count and (
            group[merged[entry, 0]] != group[i]
            or (has_lower[i] and merged[entry, 1] >= 0)
            or (has_upper[i] and merged[entry, 2] >= 0)
        ):
            entry += 1
        if entry == count:
            merged[entry, 0], merged[entry, 1], merged[entry, 2] = i, -1, -1
            count += 1
        if has_lower[i]:
            merged[entry, 1] = i
        if has_upper[i]:
            merged[entry, 2] = i
    return count
