"""Reads the matrices of a parametric quadratic program out of a `MathematicalProgram`, once.

Any program serves whose costs are quadratic and whose constraints are linear in decisions w and parameters θ,
and whose matrices do not depend on θ:

    min ½ wᵀP w + f(θ)ᵀw + constant(θ)    s.t.    lower(θ) ≤ A w ≤ upper(θ),    f, lower, upper affine in θ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.solvers import Binding, LinearConstraint, LinearCost, MathematicalProgram, QuadraticCost
from pydrake.symbolic import Variable

from pdhocbf_drake.errors import InputError
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
    for variable in decisions:
        if variable.get_type() != Variable.Type.CONTINUOUS:
            raise InputError(f"decision {variable}: only continuous variables can be compiled")
    place = np.full(prog.num_vars(), -1)
    place[prog.FindDecisionVariableIndices([*decisions, *parameters])] = np.arange(size)

    hessian, gradient, constant = np.zeros((size, size)), np.zeros(size), 0.0
    for binding in prog.GetAllCosts():
        cost, at = binding.evaluator(), _places(prog, binding, place)
        if isinstance(cost, QuadraticCost):
            if len(np.unique(at)) == len(at):
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

    blocks, lows, highs, names = [np.zeros((0, size))], [np.zeros(0)], [np.zeros(0)], list[str]()
    for binding in prog.GetAllConstraints():
        constraint, at = binding.evaluator(), _places(prog, binding, place)
        if not isinstance(constraint, LinearConstraint):
            raise InputError(f"constraint {_name(binding)}: only linear constraints can be compiled")
        block = np.zeros((constraint.num_constraints(), size))
        if len(np.unique(at)) == len(at):
            block[:, at] = constraint.GetDenseA()
        else:
            np.add.at(block.T, at, constraint.GetDenseA().T)
        blocks.append(block)
        lows.append(constraint.lower_bound())
        highs.append(constraint.upper_bound())
        names += [_name(binding)] * len(block)
    A, lower, upper, names = _merged(np.vstack(blocks), np.concatenate(lows), np.concatenate(highs), names, n)
    linear = AffineMap(gradient[:n], hessian[:n, n:])
    value = QuadraticForm(hessian[n:, n:], gradient[n:], constant)
    return ParametricQp(hessian[:n, :n].copy(), A, linear, lower, upper, tuple(names), value)


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
    leads = rows[:, :n]
    first = (leads != 0.0).argmax(axis=1) if n else np.zeros(len(rows), dtype=int)
    flip = leads[np.arange(len(rows)), first] < 0.0 if n else np.zeros(len(rows), dtype=bool)
    upright = np.where(flip[:, None], -leads, leads) + 0.0  # no negative zeros
    leader: dict[bytes, int] = {}
    group = np.array([leader.setdefault(lead.tobytes(), i) for i, lead in enumerate(upright)], dtype=int)
    turn = flip != flip[group]  # the first row of a group keeps its sign
    rows[turn] *= -1.0
    low, high = np.where(turn, -high, low), np.where(turn, -low, high)
    has_low, has_high = np.isfinite(low).tolist(), np.isfinite(high).tolist()
    merged: list[list[int]] = []  # row it is first seen in, row of the lower bound or -1, row of the upper one or -1
    members: dict[int, list[list[int]]] = {}
    for i, of in enumerate(group.tolist()):
        entries = members.setdefault(of, [])
        for entry in entries:
            if not (has_low[i] and entry[1] >= 0) and not (has_high[i] and entry[2] >= 0):
                break
        else:
            entry = [i, -1, -1]
            entries.append(entry)
            merged.append(entry)
        entry[1] = i if has_low[i] else entry[1]
        entry[2] = i if has_high[i] else entry[2]
    at, lower, upper = np.array(merged, dtype=int).reshape(-1, 3).T
    # l ≤ a·w + t·θ ≤ u   ⇔   l − t·θ ≤ a·w ≤ u − t·θ
    from_theta = np.vstack([-rows[:, n:], np.zeros(rows.shape[1] - n)])
    maps = [
        AffineMap(np.append(b, none)[of], from_theta[of])
        for b, none, of in ((low, -np.inf, lower), (high, np.inf, upper))
    ]
    return rows[at, :n] + 0.0, maps[0], maps[1], [names[i] for i in at]
