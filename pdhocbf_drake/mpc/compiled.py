"""Reads the matrices of a parametric quadratic program out of a `MathematicalProgram`, once.

Any program serves whose costs are quadratic and whose constraints are linear in decisions w and parameters θ,
and whose matrices do not depend on θ:

    min ½ wᵀP w + f(θ)ᵀw + constant(θ)    s.t.    lower(θ) ≤ A w ≤ upper(θ),    f, lower, upper affine in θ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

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
from pdhocbf_drake.jit import compiled
from pdhocbf_drake.mpc.affine_map import AffineMap
from pdhocbf_drake.mpc.quadratic_form import QuadraticForm

_CONVEX = 1e-9  # how negative an eigenvalue of P may be, relative to its largest entry


@dataclass(frozen=True)
class ParametricQp:
    """The program above as arrays; rows of A that are equal have been merged into one with both bounds.

    Attributes:
        P: quadratic cost, shape (n, n).
        A: constraint rows, shape (m, n).
        linear: f, θ → (n,).
        lower, upper: θ → (m,).
        names: the binding's description behind each row.
        constant: the cost's part that no decision changes, θ → number.
    """

    P: np.ndarray
    A: np.ndarray
    linear: AffineMap
    lower: AffineMap
    upper: AffineMap
    names: tuple[str, ...]
    constant: QuadraticForm

    def vectors(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Linear cost (n,), lower (m,) and upper bounds (m,) at θ."""
        return self.linear(theta), self.lower(theta), self.upper(theta)


def compile_program(
    prog: MathematicalProgram, decisions: Sequence[Variable] | np.ndarray, parameters: Sequence[Variable] | np.ndarray
) -> ParametricQp:
    """Reads `prog` as a quadratic program in `decisions` with parameters θ = `parameters`.

    Raises:
        InputError: a binding is of another kind, uses a variable that is neither, or its cost is not convex
            in the decisions; its description is named. Or a decision is not continuous.
    """
    n, size = len(decisions), len(decisions) + len(parameters)
    if GetProgramType(prog) not in (ProgramType.kLP, ProgramType.kQP):
        _check_continuous(decisions)
    place = np.full(prog.num_vars(), -1)
    place[prog.FindDecisionVariableIndices([*decisions, *parameters])] = np.arange(size)

    hessian, gradient, constant = np.zeros((size, size)), np.zeros(size), 0.0
    convex = True  # as is the sum of costs that are
    for binding in prog.GetAllCosts():
        cost, at = binding.evaluator(), _places(prog, binding, place)
        if isinstance(cost, QuadraticCost):
            convex = convex and cost.is_convex()
            if np.bincount(at, minlength=1).max() <= 1:  # no variable twice
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
    if not convex and not _is_convex(hessian[:n, :n]):
        raise InputError(
            f"cost {_not_convex(prog, place, n)}: it is not convex in the decisions, so it can't be compiled"
        )

    constraints = prog.GetAllConstraints()
    count = sum(binding.evaluator().num_constraints() for binding in constraints)
    rows, low, high, names = np.zeros((count, size)), np.zeros(count), np.zeros(count), list[str]()
    for binding in constraints:
        constraint, at = binding.evaluator(), _places(prog, binding, place)
        if not isinstance(constraint, LinearConstraint):
            raise InputError(f"constraint {_name(binding)}: only linear constraints can be compiled")
        block = slice(len(names), len(names) + constraint.num_constraints())
        if np.bincount(at, minlength=1).max() <= 1:  # no variable twice
            rows[block, at] = constraint.GetDenseA()
        else:
            np.add.at(rows[block].T, at, constraint.GetDenseA().T)
        low[block], high[block] = constraint.lower_bound(), constraint.upper_bound()
        names += [_name(binding)] * constraint.num_constraints()
    A, lower, upper, names = _merged(rows, low, high, names, n)
    linear = AffineMap(gradient[:n], hessian[:n, n:])
    value = QuadraticForm(hessian[n:, n:], gradient[n:], constant)
    return ParametricQp(hessian[:n, :n].copy(), A, linear, lower, upper, tuple(names), value)


def _check_continuous(decisions: Sequence[Variable] | np.ndarray) -> None:
    for variable in decisions:
        if variable.get_type() != Variable.Type.CONTINUOUS:
            raise InputError(f"decision {variable}: only continuous variables can be compiled")


def _places(prog: MathematicalProgram, binding: Binding, place: np.ndarray) -> np.ndarray:
    at: np.ndarray = place[prog.FindDecisionVariableIndices(binding.variables())]
    if at.min(initial=0) < 0:
        raise InputError(f"{_name(binding)}: uses a variable that is neither a decision nor a parameter")
    return at


def _name(binding: Binding) -> str:
    return binding.evaluator().get_description() or str(binding)


def _is_convex(P: np.ndarray) -> bool:
    """Whether P is positive semidefinite up to rounding."""
    if not len(P) or np.array_equal(P, np.diag(np.diag(P))):
        return bool(np.all(np.diag(P) >= 0.0))
    try:
        np.linalg.cholesky(0.5 * (P + P.T) + _CONVEX * np.abs(P).max() * np.eye(len(P)))
    except np.linalg.LinAlgError:
        return False
    return True


def _not_convex(prog: MathematicalProgram, place: np.ndarray, n: int) -> str:
    """The cost that makes the sum of all not convex: the first that is not convex by itself."""
    for binding in prog.quadratic_costs():
        mine = _places(prog, binding, place) < n
        if not _is_convex(binding.evaluator().Q()[np.ix_(mine, mine)]):
            return _name(binding)
    return "of all bindings together"


def _merged(
    rows: np.ndarray, low: np.ndarray, high: np.ndarray, names: list[str], n: int
) -> tuple[np.ndarray, AffineMap, AffineMap, list[str]]:
    """One row for all rows with the same, or the opposite, decision part; each bound is an affine map of θ.

    Two different lower bounds on one row can't be merged into an affine one and stay two rows.
    """
    group, turn = _equal_rows(rows[:, :n])
    rows[turn] *= -1.0
    low, high = np.where(turn, -high, low), np.where(turn, -low, high)
    merged = np.empty((len(rows), 3), dtype=int)
    at, lower, upper = merged[: _share(group, np.isfinite(low), np.isfinite(high), merged)].T
    # l ≤ a·w + t·θ ≤ u   ⇔   l − t·θ ≤ a·w ≤ u − t·θ
    return (
        rows[at, :n] + 0.0,
        _bound(low, rows, n, lower, -np.inf),
        _bound(high, rows, n, upper, np.inf),
        [names[i] for i in at],
    )


@compiled
def _share(group: np.ndarray, has_low: np.ndarray, has_high: np.ndarray, merged: np.ndarray) -> int:
    """Merges rows: each joins the first merged row of its group that lacks the bounds it has; gives how many there are.

    Fills in, for each merged row, the row that it is first seen in, that of its lower bound and that of its upper
    bound, or −1.
    """
    count = 0
    for i in range(len(group)):
        entry = 0
        while entry < count and (
            group[merged[entry, 0]] != group[i]
            or (has_low[i] and merged[entry, 1] >= 0)
            or (has_high[i] and merged[entry, 2] >= 0)
        ):
            entry += 1
        if entry == count:
            merged[entry, 0], merged[entry, 1], merged[entry, 2] = i, -1, -1
            count += 1
        if has_low[i]:
            merged[entry, 1] = i
        if has_high[i]:
            merged[entry, 2] = i
    return count


def _equal_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each row the first one that equals it or its opposite, and whether it is the opposite."""
    # Equal rows have equal sums and opposite ones opposite sums, to the last bit, whatever the weights: `einsum` adds
    # up each row in the same order, where a matrix product need not.
    sums = np.einsum("ij,j->i", rows, somewhere(rows.shape[1]))
    _, first, inverse = np.unique(np.abs(sums), return_index=True, return_inverse=True)
    group = first[inverse]
    others = np.flatnonzero(group != np.arange(len(rows)))
    sign = np.where(sums[others] == sums[group[others]], 1.0, -1.0)
    alike = (sign[:, None] * rows[others] == rows[group[others]]).all(axis=1)
    group[others[~alike]] = others[~alike]
    turn = np.zeros(len(rows), dtype=bool)
    turn[others] = alike & (sign < 0.0)
    return group, turn


def _bound(values: np.ndarray, rows: np.ndarray, n: int, of: np.ndarray, none: float) -> AffineMap:
    """The bound of each merged row, taken from row `of`; −1 stands for no bound."""
    matrix = -rows[of, n:]
    matrix[of < 0] = 0.0
    return AffineMap(np.append(values, none)[of], matrix)


@lru_cache(maxsize=16)
def somewhere(count: int) -> np.ndarray:
    """A point (count,) where two linear functions that differ are not equal by chance; do not write into it."""
    return np.random.default_rng(0).uniform(1.0, 2.0, count)
