"""Reads the matrices of a parametric quadratic program out of a `MathematicalProgram`, once.

Any program serves whose costs are quadratic and whose constraints are linear in decisions w and parameters θ:

    min ½ wᵀP w + (q + Q θ)ᵀw + ½ θᵀR θ + rᵀθ + c    s.t.    l + L θ ≤ A w ≤ u + U θ.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from pydrake.solvers import LinearConstraint, LinearCost, MathematicalProgram, QuadraticCost

from pdhocbf_drake.errors import InputError


@dataclass(frozen=True)
class ParametricQp:
    """The program above as arrays; rows of A that are equal have been merged into one with both bounds.

    Attributes:
        P, Q, q: quadratic, mixed and linear cost, shapes (n, n), (n, n_θ), (n,).
        R, r, c: the cost's part in θ alone, shapes (n_θ, n_θ), (n_θ,), ().
        A: constraint rows, shape (m, n).
        lower, lower_map, upper, upper_map: l, L, u, U; shapes (m,), (m, n_θ), (m,), (m, n_θ).
        names: the binding's description behind each row.
    """

    P: np.ndarray
    Q: np.ndarray
    q: np.ndarray
    R: np.ndarray
    r: np.ndarray
    c: float
    A: np.ndarray
    lower: np.ndarray
    lower_map: np.ndarray
    upper: np.ndarray
    upper_map: np.ndarray
    names: tuple[str, ...]

    def constant(self, theta: np.ndarray) -> float:
        """The cost's part that no decision changes."""
        return float(0.5 * theta @ self.R @ theta + self.r @ theta + self.c)

    def vectors(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Linear cost (n,), lower (m,) and upper bounds (m,) at θ."""
        return self.q + self.Q @ theta, self.lower + self.lower_map @ theta, self.upper + self.upper_map @ theta


def compile_program(prog: MathematicalProgram, decisions: np.ndarray, parameters: np.ndarray) -> ParametricQp:
    """Reads `prog` as a quadratic program in `decisions` with parameters θ = `parameters`.

    Raises:
        InputError: a binding is of another kind, or uses a variable that is neither; its description is named.
    """
    n, n_theta = len(decisions), len(parameters)
    place = {v.get_id(): i for i, v in enumerate([*decisions, *parameters])}
    hessian = np.zeros((n + n_theta, n + n_theta))
    gradient = np.zeros(n + n_theta)
    constant = 0.0
    rows: list[tuple[np.ndarray, float, float, str]] = []
    for binding in prog.GetAllCosts():
        cost, at = binding.evaluator(), _places(binding, place)
        if isinstance(cost, QuadraticCost):
            hessian[np.ix_(at, at)] += cost.Q()
            gradient[at] += cost.b()
            constant += cost.c()
        elif isinstance(cost, LinearCost):
            gradient[at] += cost.a()
            constant += cost.b()
        else:
            raise InputError(f"cost {_name(binding)}: only linear and quadratic costs can be compiled")
    for binding in prog.GetAllConstraints():
        constraint, at = binding.evaluator(), _places(binding, place)
        if not isinstance(constraint, LinearConstraint):
            raise InputError(f"constraint {_name(binding)}: only linear constraints can be compiled")
        block = np.zeros((constraint.num_constraints(), n + n_theta))
        block[:, at] = constraint.GetDenseA()
        bounds = zip(block, constraint.lower_bound(), constraint.upper_bound(), strict=True)
        rows += [(row, low, high, _name(binding)) for row, low, high in bounds]
    A, lower, lower_map, upper, upper_map, names = _merge(rows, n)
    w, t = slice(0, n), slice(n, None)
    return ParametricQp(
        hessian[w, w], hessian[w, t], gradient[w], hessian[t, t], gradient[t], constant,
        A, lower, lower_map, upper, upper_map, names,
    )  # fmt: skip


def _places(binding: object, place: dict[int, int]) -> list[int]:
    try:
        return [place[v.get_id()] for v in binding.variables()]  # type: ignore[attr-defined]
    except KeyError:
        raise InputError(f"{_name(binding)}: uses a variable that is neither a decision nor a parameter") from None


def _name(binding: object) -> str:
    return binding.evaluator().get_description() or str(binding)  # type: ignore[attr-defined]


def _merge(rows: Iterable[tuple[np.ndarray, float, float, str]], n: int) -> tuple:
    """One row for all rows with the same, or the opposite, decision part; each bound is an affine map of θ.

    Two different lower bounds on one row can't be merged into an affine one and stay two rows.
    """
    merged: list[list] = []
    seen: dict[bytes, list[int]] = {}
    for row, low, high, name in rows:
        lead = row[:n]
        nonzero = np.flatnonzero(lead)
        if len(nonzero) and lead[nonzero[0]] < 0:
            row, lead, low, high = -row, -lead, -high, -low
        key = (lead + 0.0).tobytes()
        # l ≤ a·w + t·θ ≤ u   ⇔   l − t·θ ≤ a·w ≤ u − t·θ
        for index in seen.setdefault(key, []):
            entry = merged[index]
            if (np.isinf(low) or np.isinf(entry[1])) and (np.isinf(high) or np.isinf(entry[3])):
                if np.isfinite(low):
                    entry[1:3] = [low, -row[n:]]
                if np.isfinite(high):
                    entry[3:5] = [high, -row[n:]]
                break
        else:
            seen[key].append(len(merged))
            none = np.zeros(len(row) - n)
            merged.append([
                lead, low, -row[n:] if np.isfinite(low) else none, high, -row[n:] if np.isfinite(high) else none, name,
            ])  # fmt: skip
    A, lower, lower_map, upper, upper_map = (np.array([entry[i] for entry in merged]) for i in range(5))
    return A, lower, lower_map, upper, upper_map, tuple(entry[5] for entry in merged)
