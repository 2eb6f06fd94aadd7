"""Every compiled loop of `pdhocbf_drake.qp` beside a few lines of numpy that compute the same."""

from __future__ import annotations

import os

import numpy as np
import pytest
from kernel_cases import Values, assert_agreement, by_name, kernels_of
from qp_programs import random_program

from pdhocbf_drake.qp import AffineMap, DaqpQp, QuadraticForm, compile_program, kernels
from pdhocbf_drake.qp.affine_map import by_columns, compressed


def sparse(random: np.random.Generator, rows: int, columns: int) -> np.ndarray:
    return random.normal(size=(rows, columns)) * (random.random((rows, columns)) < random.uniform(0.1, 0.9))


def write_affine(random: np.random.Generator) -> tuple[Values, Values]:
    offset, matrix, theta = random.normal(size=9), sparse(random, 9, 5), random.normal(size=5)
    out = np.empty(9)
    kernels.write_affine(*AffineMap(offset, matrix).arrays, theta, out)
    return (out,), (offset + matrix @ theta,)


def write_product(random: np.random.Generator) -> tuple[Values, Values]:
    matrix, vector, out = sparse(random, 7, 5), random.normal(size=5), np.empty(7)
    matrix[:, random.integers(5)] = 0.0
    kernels.write_product(*by_columns(matrix), vector, out)
    return (out,), (matrix @ vector,)


def quadratic_value(random: np.random.Generator) -> tuple[Values, Values]:
    R, r, theta = sparse(random, 6, 6), random.normal(size=6) * random.integers(0, 2, 6), random.normal(size=6)
    R = R + R.T
    value = kernels.quadratic_value(QuadraticForm(R, r, 2.0).arrays, theta)
    return (value,), (0.5 * theta @ R @ theta + r @ theta + 2.0,)


def is_finite(random: np.random.Generator) -> tuple[Values, Values]:
    vector = random.choice([1.0, -2.0, 1e308, np.inf, -np.inf, np.nan], 4, p=[0.4, 0.3, 0.15, 0.05, 0.05, 0.05])
    return (kernels.is_finite(vector),), (np.isfinite(vector).all(),)


def write_senses(random: np.random.Generator) -> tuple[Values, Values]:
    guess, source = random.choice([-1.0, 0.0, 1.0], 12), random.permutation(12)[:9]
    cold = random.choice([0, kernels.EQUALITY, kernels.SOFT], 9).astype(np.int32)
    out = np.empty(9, dtype=np.int32)
    kernels.write_senses(guess, source, cold, out)
    flags = np.select([guess > 0, guess < 0], [kernels.ACTIVE_UPPER, kernels.ACTIVE_LOWER])[source]
    return (out,), (np.where(cold == kernels.EQUALITY, cold, cold | flags),)


def write_limits(random: np.random.Generator) -> tuple[Values, Values]:
    n, m, parameters = 5, 8, 4
    L = np.tril(sparse(random, n, n), -1) + np.diag(random.uniform(0.5, 2.0, n))
    R = np.vstack([np.eye(3, n), sparse(random, m - 3, n)])
    g = AffineMap(random.normal(size=n), sparse(random, n, parameters))
    bounds = AffineMap(random.choice([-np.inf, 1.0, 3.0, np.inf], 2 * m), sparse(random, 2 * m, parameters))
    constant = QuadraticForm(np.eye(parameters), random.normal(size=parameters), 1.5)
    theta, optimum, beyond, limits = random.normal(size=parameters), np.empty(n), np.empty(m - 3), np.empty(2 * m)
    least = kernels.write_limits(
        g.arrays, bounds.arrays, compressed(L), by_columns(R[3:]), constant.arrays, theta, optimum, beyond, limits
    )
    z = -np.linalg.solve(L @ L.T, g(theta))
    expected = bounds(theta) - np.tile(R @ z, 2)
    return (least, optimum, beyond, limits), (constant(theta) + 0.5 * g(theta) @ z, z, (R @ z)[3:], expected)


def write_slacks(random: np.random.Generator) -> tuple[Values, Values]:
    n, m = 4, 7
    R, y = np.vstack([np.eye(3, n), sparse(random, m - 3, n)]), random.normal(size=n)
    low, high = random.normal(size=m) - 0.5, random.normal(size=m) + 0.5
    softened, columns = random.permutation(m)[:4], random.permutation(6)[:4]
    linear, quadratic, decisions, beyond = *random.random((2, 4)), np.zeros(6), np.empty(m - 3)
    cost = kernels.write_slacks(
        by_columns(R[3:]), softened, columns, linear, quadratic, y, beyond, np.concatenate([low, high]), decisions
    )
    slack = np.maximum(0.0, np.maximum(low - R @ y, R @ y - high))[softened]
    expected = np.zeros(6)
    expected[columns] = slack
    return (cost, decisions), ((linear * slack + 0.5 * quadratic * slack**2).sum(), expected)


def write_decisions(random: np.random.Generator) -> tuple[Values, Values]:
    n, m = 5, 8
    L = np.tril(sparse(random, n, n), -1) + np.diag(random.uniform(0.5, 2.0, n))
    inverse, hard, order = sparse(random, n, n), random.permutation(7)[:n], random.permutation(m + 2)[:m]
    z, y, multipliers = random.normal(size=n), random.normal(size=n), random.choice([-0.3, 0.0, 2.0], m)
    decisions, active, product = np.zeros(7), np.zeros(m + 2), np.empty(n)
    cost = kernels.write_decisions(
        compressed(L), compressed(inverse), hard, order, z, y, multipliers, decisions, active, product
    )
    w, flags = np.zeros(7), np.zeros(m + 2)
    w[hard], flags[order] = inverse @ (z + y), np.sign(multipliers)
    return (cost, decisions, active, product), (0.5 * y @ L @ L.T @ y, w, flags, L.T @ y)


def solve_packed(random: np.random.Generator) -> tuple[Values, Values]:
    solver = DaqpQp(compile_program(*random_program(int(random.integers(100)), slacks=True)))
    assert solver.packed is not None
    ours, theirs = (solver.arguments(0.2 * random.normal(size=4), None) for _ in range(2))
    answer = kernels.solve_packed(*solver.packed.arrays, *ours)
    return (*answer, *ours[2:]), (*solver.steps.solve(ours[0], *theirs[1:]), *theirs[2:])


def solve_programs(random: np.random.Generator) -> tuple[Values, Values]:
    solver = DaqpQp(compile_program(*random_program(int(random.integers(100)), slacks=True)))
    assert solver.packed is not None
    packed, (first, second) = solver.packed.arrays, (solver.arguments(0.2 * random.normal(size=4), None) for _ in "xy")
    both = kernels.solve_programs(2, *packed, *first, *packed, *second)
    one = kernels.solve_programs(1, *packed, *first, *packed, *first)[2:]
    alone = [solver.steps.solve(given[0], *solver.arguments(given[0], None)[1:]) for given in (first, second)]
    return (*both, *one), (*alone[0], *alone[1], *alone[0])


def merge_rows(random: np.random.Generator) -> tuple[Values, Values]:
    group, has = random.integers(0, 4, 12), random.random((12, 2)) < 0.6
    written = np.empty((12, 3), dtype=int)
    count = kernels.merge_rows(group, has[:, 0], has[:, 1], written)
    merged: list[list[int]] = []
    for i in range(12):
        own = [i if lower_or_upper else -1 for lower_or_upper in has[i]]
        free = [e for e in merged if group[e[0]] == group[i] and (np.minimum(e[1:], own) == -1).all()]
        if not free:
            merged.append([i, *own])
        else:
            free[0][1:] = np.maximum(free[0][1:], own)
    return (count, written[:count]), (len(merged), np.array(merged))


CALLS_OF_DAQP = ("solve_packed", "solve_programs")
CASES = by_name(
    write_affine, write_product, quadratic_value, is_finite, write_senses, write_limits, write_decisions,
    write_slacks, solve_packed, solve_programs, merge_rows,
)  # fmt: skip


def test_every_kernel_has_a_reference() -> None:
    assert kernels_of(kernels) == set(CASES)


@pytest.mark.parametrize("name", CASES)
def test_kernels_agree_with_numpy(name: str) -> None:
    if name in CALLS_OF_DAQP and os.environ.get("NUMBA_DISABLE_JIT") == "1":
        pytest.skip("DAQP's functions are called from compiled code only")
    assert_agreement(CASES[name], 1e-11)
