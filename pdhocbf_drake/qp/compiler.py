"""Compiles a `MathematicalProgram` with parameters into a `ParametricQp`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.solvers import (
    Binding,
    GetProgramType,
    LinearConstraint,
    LinearCost,
    MathematicalProgram,
    ProgramType,
    QuadraticCost,
)
from pydrake.symbolic import Variable

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp.affine_map import AffineMap, QuadraticForm, generic_point
from pdhocbf_drake.qp.kernels import merge_rows
from pdhocbf_drake.qp.parametric_qp import ParametricQp

_CONVEX = 1e-9  # how negative an eigenvalue of P may be, relative to its largest entry


def compile_program(
    prog: MathematicalProgram, decisions: Sequence[Variable] | np.ndarray, parameters: Sequence[Variable] | np.ndarray
) -> ParametricQp:
    """Reads `prog` as a quadratic program in w = `decisions` with parameters θ = `parameters`.

    Its costs must be linear or quadratic and its constraints linear, both in w and θ together. Then the matrices of
    the program in w do not depend on θ, and its vectors are affine in θ. Rows of constraints with equal, or opposite,
    coefficients of w become one row with both bounds; two different lower bounds stay two rows, since the larger of
    two affine maps is not affine.

    Raises:
        InputError: a binding is of another kind, or uses a variable that is neither a decision nor a parameter, or
            the cost is not convex in w; the binding's description is named. Or a decision is not continuous.
    """
    n, size = len(decisions), len(decisions) + len(parameters)
    if GetProgramType(prog) not in (ProgramType.kLP, ProgramType.kQP):  # a QP has continuous variables alone
        for variable in decisions:
            if variable.get_type() != Variable.Type.CONTINUOUS:
                raise InputError(f"decision {variable}: only continuous variables can be compiled")
    place = np.full(prog.num_vars(), -1)
    place[prog.FindDecisionVariableIndices([*decisions, *parameters])] = np.arange(size)

    hessian, gradient, constant = _costs(prog, place, size)
    if not _is_convex(hessian[:n, :n]):
        name = _not_convex(prog, place, n)
        raise InputError(f"cost {name}: it is not convex in the decisions, so it can't be compiled")
    A, lower, upper, names = _merged(*_constraints(prog, place, size), n)
    linear = AffineMap(gradient[:n], hessian[:n, n:])
    value = QuadraticForm(hessian[n:, n:], gradient[n:], constant)
    return ParametricQp(hessian[:n, :n].copy(), A, linear, lower, upper, names, value)


def _costs(prog: MathematicalProgram, place: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Hessian, gradient at 0 and value at 0 of the sum of all costs in [w, θ]."""
    hessian, gradient, constant = np.zeros((size, size)), np.zeros(size), 0.0
    for binding in prog.GetAllCosts():
        cost, at = binding.evaluator(), _places(prog, binding, place)
        if isinstance(cost, QuadraticCost):
            if _are_distinct(at):
                hessian[np.ix_(at, at)] += cost.Q()
            else:
                np.add.at(hessian, np.ix_(at, at), cost.Q())
            np.add.at(gradient, at, cost.b())
            constant += cost.c()
        elif isinstance(cost, LinearCost):
            np.add.at(gradient, at, cost.a())
            constant += cost.b()
        else:
            raise InputError(f"cost {_name(binding)}: only linear and quadratic costs can be compiled")
    return hessian, gradient, constant


def _constraints(
    prog: MathematicalProgram, place: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[str]]:
    """Coefficients of [w, θ], lower bound, upper bound and name of the rows of all constraints."""
    constraints = prog.GetAllConstraints()
    count = sum(binding.evaluator().num_constraints() for binding in constraints)
    rows, low, high, names = np.zeros((count, size)), np.zeros(count), np.zeros(count), list[str]()
    for binding in constraints:
        constraint, at = binding.evaluator(), _places(prog, binding, place)
        if not isinstance(constraint, LinearConstraint):
            raise InputError(f"constraint {_name(binding)}: only linear constraints can be compiled")
        block = slice(len(names), len(names) + constraint.num_constraints())
        if _are_distinct(at):
            rows[block, at] = constraint.GetDenseA()
        else:
            np.add.at(rows[block].T, at, constraint.GetDenseA().T)
        low[block], high[block] = constraint.lower_bound(), constraint.upper_bound()
        names += [_name(binding)] * constraint.num_constraints()
    return rows, low, high, names


def _merged(
    rows: np.ndarray, low: np.ndarray, high: np.ndarray, names: list[str], n: int
) -> tuple[np.ndarray, AffineMap, AffineMap, tuple[str, ...]]:
    """A, lower, upper and names of the merged rows; changes signs in `rows`."""
    group, opposite = _groups(rows[:, :n])
    rows[opposite] *= -1.0
    low, high = np.where(opposite, -high, low), np.where(opposite, -low, high)
    merged = np.empty((len(rows), 3), dtype=int)
    at, lower, upper = merged[: merge_rows(group, np.isfinite(low), np.isfinite(high), merged)].T

    def bound(values: np.ndarray, source: np.ndarray, none: float) -> AffineMap:
        # l ≤ a·w + t·θ ≤ u   ⇔   l − t·θ ≤ a·w ≤ u − t·θ
        matrix = -rows[source, n:]
        matrix[source < 0] = 0.0
        return AffineMap(np.append(values, none)[source], matrix)

    A = rows[at, :n] + 0.0  # no −0
    return A, bound(low, lower, -np.inf), bound(high, upper, np.inf), tuple(names[i] for i in at)


def _groups(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each row the first one that equals it or its opposite, and whether it is the opposite."""
    # With any weights equal rows have equal sums, and opposite ones opposite sums, to the last bit: `einsum` adds up
    # each row in the same order, where a matrix product need not.
    sums = np.einsum("ij,j->i", rows, generic_point(rows.shape[1]))
    _, first, inverse = np.unique(np.abs(sums), return_index=True, return_inverse=True)
    group = first[inverse]
    opposite = sums != sums[group]
    others = np.flatnonzero(group != np.arange(len(rows)))
    sign = np.where(opposite[others], -1.0, 1.0)
    differ = others[(sign[:, None] * rows[others] != rows[group[others]]).any(axis=1)]  # equal sums by chance
    group[differ], opposite[differ] = differ, False
    return group, opposite


def _places(prog: MathematicalProgram, binding: Binding, place: np.ndarray) -> np.ndarray:
    at: np.ndarray = place[prog.FindDecisionVariableIndices(binding.variables())]
    if at.min(initial=0) < 0:
        raise InputError(f"{_name(binding)}: uses a variable that is neither a decision nor a parameter")
    return at


def _are_distinct(places: np.ndarray) -> bool:
    return bool(np.bincount(places, minlength=1).max() <= 1)


def _name(binding: Binding) -> str:
    return binding.evaluator().get_description() or str(binding)


def _is_convex(P: np.ndarray) -> bool:
    """Whether P is positive semidefinite up to rounding."""
    products = P != 0.0
    np.fill_diagonal(products, False)
    coupled = products.any(axis=0) | products.any(axis=1)
    if np.any(np.diag(P)[~coupled] < 0.0):  # slacks, say, each with its own square alone
        return False
    block = P[np.ix_(coupled, coupled)]
    rounding = _CONVEX * np.abs(P).max(initial=0.0) * np.eye(len(block))
    try:
        np.linalg.cholesky(0.5 * (block + block.T) + rounding)
    except np.linalg.LinAlgError:
        return False
    return True


def _not_convex(prog: MathematicalProgram, place: np.ndarray, n: int) -> str:
    """The description of the first cost that is not convex in w by itself."""
    for binding in prog.quadratic_costs():
        mine = _places(prog, binding, place) < n
        if not _is_convex(binding.evaluator().Q()[np.ix_(mine, mine)]):
            return _name(binding)
    return "of all bindings together"
