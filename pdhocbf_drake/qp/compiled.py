"""Reads the matrices of a parametric quadratic program out of a `MathematicalProgram`, once.

Any program serves whose costs are quadratic and whose constraints are linear in decisions w and parameters θ,
and whose matrices do not depend on θ:

    min ½ wᵀP w + f(θ)ᵀw + constant(θ)    s.t.    lower(θ) ≤ A w ≤ upper(θ),    f, lower, upper affine in θ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
from pdhocbf_drake.qp.affine_map import AffineMap
from pdhocbf_drake.qp.merged_rows import merged_rows
from pdhocbf_drake.qp.quadratic_form import QuadraticForm

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
    if GetProgramType(prog) not in (ProgramType.kLP, ProgramType.kQP):  # else Drake says it faster than each variable
        _check_continuous(decisions)
    place = np.full(prog.num_vars(), -1)
    place[prog.FindDecisionVariableIndices([*decisions, *parameters])] = np.arange(size)

    hessian, gradient, constant = np.zeros((size, size)), np.zeros(size), 0.0
    for binding in prog.GetAllCosts():
        cost, at = binding.evaluator(), _places(prog, binding, place)
        if isinstance(cost, QuadraticCost):
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
    if not _is_convex(hessian[:n, :n]):
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
    A, lower, upper, names = merged_rows(rows, low, high, names, n)
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
    """The cost that makes the sum of all not convex: the first that is not convex by itself."""
    for binding in prog.quadratic_costs():
        mine = _places(prog, binding, place) < n
        if not _is_convex(binding.evaluator().Q()[np.ix_(mine, mine)]):
            return _name(binding)
    return "of all bindings together"
