"""The compiled loops of this room: sparse maps of θ, DAQP's vectors and the way back from them, merging of rows."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import types

from pdhocbf_drake.jit import compiled

Sparse: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray]
"""A matrix in compressed rows: starts, columns, values. Row i has values[starts[i] : starts[i + 1]] in the columns
columns[starts[i] : starts[i + 1]]."""

Affine: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""The map offset + M θ: offset, then M as in `Sparse`."""

Columns: TypeAlias = tuple[np.ndarray, np.ndarray, np.ndarray]
"""A matrix by columns, each from its first to its last entry that is not zero: starts, firsts, values. Column j has
values[starts[j] : starts[j + 1]] in the rows from firsts[j] on."""

Quadratic: TypeAlias = tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""The form c + Σ θ_i (r_i + ½ Σ_j R_ij θ_j): c, the indices i that occur, then the map r + ½ R θ as in `Affine`."""

ACTIVE_UPPER, ACTIVE_LOWER, EQUALITY, SOFT = 1, 3, 5, 8
"""What DAQP calls the sense of a constraint; bits of one integer."""

NEW_LIMITS_AND_SENSES = 8 + 16
"""What DAQP is to read anew: bits of one integer."""

OPTIMAL_SOFTENED, DEPENDENT = 2, -6
"""DAQP's flags for an optimum that violates soft rows, and for a working set of rows that depend on each other."""

WORKSPACE, PROBLEM, RESULT, FLAG = range(4)
"""The first of `PackedQp.places`: addresses of DAQP's structures, and where its flag lies among the integers."""

# Then, for each array, where it begins and ends among the real numbers,
(
    GRADIENT, GRADIENT_VALUES, BOUNDS, BOUNDS_VALUES, ROOT_VALUES, ROWS_VALUES, CONSTANT, CONSTANT_VECTOR,
    CONSTANT_VALUES, INVERSE_VALUES, SLACK_LINEAR, SLACK_QUADRATIC, OPTIMUM, PRODUCT, BEYOND, LIMITS, Y, MULTIPLIERS,
) = range(4, 40, 2)  # fmt: skip
# or among the integers.
(
    STRUCTURES, GRADIENT_STARTS, GRADIENT_COLUMNS, BOUNDS_STARTS, BOUNDS_COLUMNS, ROOT_STARTS, ROOT_COLUMNS,
    ROWS_STARTS, ROWS_FIRSTS, CONSTANT_USED, CONSTANT_STARTS, CONSTANT_COLUMNS, INVERSE_STARTS, INVERSE_COLUMNS,
    HARD, ORDER, SOFTENED, SLACK_COLUMNS, GUESS_FROM, COLD, SENSES,
) = range(40, 82, 2)  # fmt: skip

daqp_update_ldp: Any = types.ExternalFunction("daqp_update_ldp", types.int32(types.int32, types.intp, types.intp))
daqp_solve: Any = types.ExternalFunction("daqp_solve", types.void(types.intp, types.intp))
"""DAQP's functions, see `daqp_library`."""


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
def write_product(
    starts: np.ndarray, firsts: np.ndarray, values: np.ndarray, vector: np.ndarray, out: np.ndarray
) -> None:
    """Writes the product of a matrix by columns with a vector into `out`, its terms in the order of the columns."""
    for i in range(len(out)):
        out[i] = 0.0
    for j in range(len(firsts)):
        column, factor = values[starts[j] : starts[j + 1]], vector[j]
        rows = out[firsts[j] : firsts[j] + len(column)]
        for i in range(len(column)):
            rows[i] += column[i] * factor


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
    gradient: Affine, bounds: Affine, root: Sparse, rows: Columns, constant: Quadratic, theta: np.ndarray,
    optimum: np.ndarray, beyond: np.ndarray, limits: np.ndarray,
) -> float:  # fmt: skip
    """Writes z° = −(L Lᵀ)⁻¹ g(θ) into `optimum` and [l(θ) − R z°, u(θ) − R z°] into `limits`; see `DaqpForm`.

    Args:
        gradient: g. bounds: l, then u, shape (2m,).
        root: L, the diagonal last in each row.
        rows: R without its first rows, which are those of the identity.
        beyond: work space, filled with those rows times z°.
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
    write_product(rows[0], rows[1], rows[2], optimum, beyond)
    simple = m - len(beyond)
    for i in range(m):
        at = optimum[i] if i < simple else beyond[i - simple]
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
def write_slacks(
    rows: Columns, softened: np.ndarray, columns: np.ndarray, linear: np.ndarray, quadratic: np.ndarray, y: np.ndarray,
    beyond: np.ndarray, limits: np.ndarray, decisions: np.ndarray,
) -> float:  # fmt: skip
    """Writes by how much y violates each soft row into decisions[columns].

    Args:
        rows, beyond: as in `write_limits`.
        softened: the soft rows. linear, quadratic: cost of a violation s: linear · s + ½ quadratic · s².
        limits: of all rows, the lower ones first.

    Returns:
        The cost of the violations.
    """
    write_product(rows[0], rows[1], rows[2], y, beyond)
    m, cost = len(limits) // 2, 0.0
    simple = m - len(beyond)
    for i in range(len(softened)):
        row = softened[i]
        value = y[row] if row < simple else beyond[row - simple]
        slack = max(0.0, limits[row] - value, value - limits[m + row])
        decisions[columns[i]] = slack
        cost += slack * (linear[i] + 0.5 * quadratic[i] * slack)
    return cost


@compiled
def solve_packed(
    reals: np.ndarray, integers: np.ndarray, places: np.ndarray, theta: np.ndarray, guess: np.ndarray,
    decisions: np.ndarray, active: np.ndarray,
) -> tuple[int, float]:  # fmt: skip
    """Solves a program at θ in one call, as `DaqpSteps.solve` does.

    Args:
        reals, integers, places: see `PackedQp`.
        guess: flags of the active set to start from; empty for none.
        decisions, active: written where there is an optimum, as in `QpResult`, else zero.

    Returns:
        DAQP's flag, and the cost.
    """
    at = places
    root = (
        integers[at[ROOT_STARTS] : at[ROOT_STARTS + 1]],
        integers[at[ROOT_COLUMNS] : at[ROOT_COLUMNS + 1]],
        reals[at[ROOT_VALUES] : at[ROOT_VALUES + 1]],
    )
    rows = (
        integers[at[ROWS_STARTS] : at[ROWS_STARTS + 1]],
        integers[at[ROWS_FIRSTS] : at[ROWS_FIRSTS + 1]],
        reals[at[ROWS_VALUES] : at[ROWS_VALUES + 1]],
    )
    optimum, y = reals[at[OPTIMUM] : at[OPTIMUM + 1]], reals[at[Y] : at[Y + 1]]
    beyond, limits = reals[at[BEYOND] : at[BEYOND + 1]], reals[at[LIMITS] : at[LIMITS + 1]]
    cost = write_limits(
        (
            reals[at[GRADIENT] : at[GRADIENT + 1]],
            integers[at[GRADIENT_STARTS] : at[GRADIENT_STARTS + 1]],
            integers[at[GRADIENT_COLUMNS] : at[GRADIENT_COLUMNS + 1]],
            reals[at[GRADIENT_VALUES] : at[GRADIENT_VALUES + 1]],
        ),
        (
            reals[at[BOUNDS] : at[BOUNDS + 1]],
            integers[at[BOUNDS_STARTS] : at[BOUNDS_STARTS + 1]],
            integers[at[BOUNDS_COLUMNS] : at[BOUNDS_COLUMNS + 1]],
            reals[at[BOUNDS_VALUES] : at[BOUNDS_VALUES + 1]],
        ),
        root,
        rows,
        (
            reals[at[CONSTANT]],
            integers[at[CONSTANT_USED] : at[CONSTANT_USED + 1]],
            reals[at[CONSTANT_VECTOR] : at[CONSTANT_VECTOR + 1]],
            integers[at[CONSTANT_STARTS] : at[CONSTANT_STARTS + 1]],
            integers[at[CONSTANT_COLUMNS] : at[CONSTANT_COLUMNS + 1]],
            reals[at[CONSTANT_VALUES] : at[CONSTANT_VALUES + 1]],
        ),
        theta,
        optimum,
        beyond,
        limits,
    )
    cold, senses = integers[at[COLD] : at[COLD + 1]], integers[at[SENSES] : at[SENSES + 1]]
    guess_from = integers[at[GUESS_FROM] : at[GUESS_FROM + 1]]
    for i in range(len(decisions)):
        decisions[i] = 0.0
    for i in range(len(active)):
        active[i] = 0.0
    flag, attempts = np.int32(-1), 2 if len(guess) else 1
    while flag < 0 and attempts:
        if attempts == 2:
            write_senses(guess, guess_from, cold, senses)
        else:
            for i in range(len(cold)):  # to assign a slice takes seconds to compile
                senses[i] = cold[i]
        flag = daqp_update_ldp(NEW_LIMITS_AND_SENSES, at[WORKSPACE], at[PROBLEM])
        if flag >= 0:
            daqp_solve(at[RESULT], at[WORKSPACE])
            flag = np.int32(integers[at[FLAG]])
            if flag > 0 and not is_finite(y):
                flag = np.int32(DEPENDENT)
        attempts -= 1
    if flag > 0:
        cost += write_decisions(
            root,
            (
                integers[at[INVERSE_STARTS] : at[INVERSE_STARTS + 1]],
                integers[at[INVERSE_COLUMNS] : at[INVERSE_COLUMNS + 1]],
                reals[at[INVERSE_VALUES] : at[INVERSE_VALUES + 1]],
            ),
            integers[at[HARD] : at[HARD + 1]],
            integers[at[ORDER] : at[ORDER + 1]],
            optimum,
            y,
            reals[at[MULTIPLIERS] : at[MULTIPLIERS + 1]],
            decisions,
            active,
            reals[at[PRODUCT] : at[PRODUCT + 1]],
        )
    if flag == OPTIMAL_SOFTENED:
        cost += write_slacks(
            rows,
            integers[at[SOFTENED] : at[SOFTENED + 1]],
            integers[at[SLACK_COLUMNS] : at[SLACK_COLUMNS + 1]],
            reals[at[SLACK_LINEAR] : at[SLACK_LINEAR + 1]],
            reals[at[SLACK_QUADRATIC] : at[SLACK_QUADRATIC + 1]],
            y,
            beyond,
            limits,
            decisions,
        )
    return int(flag), cost


@compiled
def solve_programs(
    count: int,
    reals: np.ndarray, integers: np.ndarray, places: np.ndarray, theta: np.ndarray, guess: np.ndarray,
    decisions: np.ndarray, active: np.ndarray,
    reals_2: np.ndarray, integers_2: np.ndarray, places_2: np.ndarray, theta_2: np.ndarray, guess_2: np.ndarray,
    decisions_2: np.ndarray, active_2: np.ndarray,
) -> tuple[int, float, int, float]:  # fmt: skip
    """`solve_packed` of one program and, if `count` is 2, of a second one, which may be the same: both answers."""
    first, second = (0, 0.0), (0, 0.0)
    for i in range(count):  # so that the machine code has it once
        if i == 0:
            r, n, p, t, g, d, a = reals, integers, places, theta, guess, decisions, active
        else:
            r, n, p, t, g, d, a = reals_2, integers_2, places_2, theta_2, guess_2, decisions_2, active_2
        first, second = second, solve_packed(r, n, p, t, g, d, a)
    return first[0], first[1], second[0], second[1]


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
