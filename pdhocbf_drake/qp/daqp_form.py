"""A parametric quadratic program in the coordinates in which DAQP solves it fastest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp.affine_map import AffineMap, by_columns, compressed, generic_point
from pdhocbf_drake.qp.kernels import EQUALITY, SOFT, Sparse
from pdhocbf_drake.qp.parametric_qp import ParametricQp

_NOISE = 1e-13  # entries of a computed matrix below this part of its largest one are zeros plus rounding


class Slacks(NamedTuple):
    """Decisions s ≥ 0 that soften one row each, a·w + s ≥ l(θ) or a·w − s ≤ u(θ), at a cost that grows with s.

    Attributes:
        columns: their indices among the decisions.
        rows: the row that each softens.
        bounds: its row s ≥ 0.
        linear, quadratic: its cost linear·s + ½ quadratic·s².
    """

    columns: np.ndarray
    rows: np.ndarray
    bounds: np.ndarray
    linear: np.ndarray
    quadratic: np.ndarray


def find_slacks(qp: ParametricQp) -> Slacks:
    """All decisions of that form, one a row at most; any other (in two rows, or with a coupled cost) is left out."""
    priced = (np.count_nonzero(qp.P, axis=1) == 1) & (np.diag(qp.P) > 0.0)
    priced &= (qp.linear.offset >= 0.0) & ~qp.linear.changing
    single = np.count_nonzero(qp.A, axis=1) == 1
    no_lower, no_upper = np.isneginf(qp.lower.offset), np.isposinf(qp.upper.offset)
    from_zero = np.flatnonzero(single & no_upper & (qp.lower.offset == 0.0) & ~qp.lower.changing)
    soft = np.flatnonzero(~single & (no_lower | no_upper))
    in_bounds, in_rows = qp.A[from_zero] == 1.0, qp.A[soft] == np.where(no_upper, 1.0, -1.0)[soft, None]
    once = (in_bounds.sum(axis=0) == 1) & (in_rows.sum(axis=0) == 1) & (np.count_nonzero(qp.A, axis=0) == 2)
    columns = np.flatnonzero(priced & once)
    rows = soft[np.nonzero(in_rows[:, columns].T)[1]]
    first = np.sort(np.unique(rows, return_index=True)[1])  # a row's second slack is an ordinary decision
    columns, rows = columns[first], rows[first]
    bounds = from_zero[np.nonzero(in_bounds[:, columns].T)[1]]
    return Slacks(columns, rows, bounds, qp.linear.offset[columns], qp.P[columns, columns])


class DaqpForm:
    """min ½ yᵀH y  s.t.  l(θ) − R z°(θ) ≤ R y ≤ u(θ) − R z°(θ), the program without its slacks.

    DAQP prices the violation of a soft row itself, so that the slacks of `find_slacks` are left out, and a soft row
    that holds costs no time. Of the other n decisions w, DAQP solves for y = M w − z°(θ):

    - M, square and invertible, has the rows of A named in `bound_rows`, or is the identity without such names. Then
      the first rows of R = A M⁻¹ are those of the identity, simple bounds on y, which an active-set method handles
      at no cost.
    - z° = −H⁻¹ M⁻ᵀ f(θ), with H = M⁻ᵀ P M⁻¹ = L Lᵀ, is the optimum without constraints, so that no linear cost
      is left. It is computed at each θ by L, which is banded over a horizon, where a matrix θ → z° would be full.

    Attributes:
        hessian: H, shape (n, n).
        rows: the rows of R after the simple bounds.
        hard: the decisions that are not slacks, shape (n,).
        order: the rows of A that are left, simple bounds first, shape (m,).
        bounds: l(θ), then u(θ), of these rows.
        slacks: what was left out. softened: the rows that they soften, as places in `order`.
        senses: DAQP's senses of the rows without a guess of the active set, shape (m,).
        to_limits, to_decisions, to_slacks: the constant arguments of `kernels.write_limits`, `write_decisions` and
            `write_slacks`.

    Raises:
        InputError: the bound rows don't form an invertible square matrix, or the cost is not strictly convex.
    """

    def __init__(self, qp: ParametricQp, bound_rows: Sequence[str]) -> None:
        self.slacks = find_slacks(qp)
        self.hard = np.delete(np.arange(len(qp.P)), self.slacks.columns)
        left = np.delete(np.arange(len(qp.A)), self.slacks.bounds)
        is_bound = np.array([qp.names[row] in bound_rows for row in left], dtype=bool)
        if bound_rows and is_bound.sum() != len(self.hard):
            raise InputError(
                f"bound rows {list(bound_rows)}: {len(self.hard)} rows are needed, one a decision "
                f"(given: {is_bound.sum()})"
            )
        self.order = np.concatenate([left[is_bound], left[~is_bound]])
        place = np.empty(len(qp.A), dtype=int)
        place[self.order] = np.arange(len(self.order))
        self.softened = place[self.slacks.rows]
        simple = int(is_bound.sum())
        A = qp.A[np.ix_(self.order, self.hard)]
        inverse = _inverse(A[:simple], bound_rows) if bound_rows else np.eye(len(self.hard))
        self.rows = A[simple:] @ inverse
        hessian = _cleaned(inverse.T @ qp.P[np.ix_(self.hard, self.hard)] @ inverse)
        self.hessian = 0.5 * (hessian + hessian.T)
        root = _root(self.hessian)
        gradient = AffineMap(inverse.T @ qp.linear.offset[self.hard], _cleaned(inverse.T @ qp.linear.matrix[self.hard]))
        lower, upper = qp.lower.rows(self.order), qp.upper.rows(self.order)
        self.bounds = lower.stacked(upper)
        rows = by_columns(_cleaned(self.rows.copy()))
        self.to_limits = (gradient.arrays, self.bounds.arrays, root, rows, qp.constant.arrays)
        self.to_decisions = (root, compressed(inverse), self.hard, self.order)
        self.to_slacks = (rows, self.softened, self.slacks.columns, self.slacks.linear, self.slacks.quadratic)

        theta = generic_point(lower.parameters)
        equal = (lower.offset == upper.offset) & (lower(theta) == upper(theta))
        self.senses = np.zeros(len(self.order), dtype=np.int32)
        self.senses[self.softened] = SOFT
        self.senses[equal] = EQUALITY

    @property
    def wide_limits(self) -> np.ndarray:
        """Upper limits, and with the other sign lower ones, that don't contradict each other at any θ, (m,)."""
        return wide_limits(self.senses)

    @property
    def soft_weights(self) -> tuple[np.ndarray, np.ndarray]:
        """1/quadratic and linear for the soft rows, zero for the others, shape (m,) each."""
        return soft_weights(len(self.order), self.softened, self.slacks.linear, self.slacks.quadratic)


def wide_limits(senses: np.ndarray) -> np.ndarray:
    """`DaqpForm.wide_limits`, from the senses of the rows."""
    return np.where(senses == EQUALITY, 0.0, 1e30)


def soft_weights(
    count: int, softened: np.ndarray, linear: np.ndarray, quadratic: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """`DaqpForm.soft_weights` of so many rows, from the places of the soft ones and the costs of their slacks."""
    inverse, slope = np.zeros(count), np.zeros(count)
    inverse[softened], slope[softened] = 1.0 / quadratic, linear
    return inverse, slope


def _root(hessian: np.ndarray) -> Sparse:
    """L with L Lᵀ = hessian; the diagonal is the last entry of each row."""
    try:
        return compressed(_cleaned(np.linalg.cholesky(hessian)))
    except np.linalg.LinAlgError:
        raise InputError(
            "the cost is not strictly convex in the decisions, as DAQP needs it: choose clarabel"
        ) from None


def _inverse(rows: np.ndarray, bound_rows: Sequence[str]) -> np.ndarray:
    try:
        inverse = np.linalg.inv(rows)
    except np.linalg.LinAlgError:
        inverse = np.full(rows.shape, np.inf)
    if not np.abs(inverse).max() * np.abs(rows).max() < 1e12:
        raise InputError(f"bound rows {list(bound_rows)}: they don't form an invertible matrix")
    return _cleaned(inverse)


def _cleaned(matrix: np.ndarray) -> np.ndarray:
    """The matrix itself, with rounding left of zeros overwritten by zeros."""
    size = np.abs(matrix)
    matrix[size < _NOISE * size.max(initial=0.0)] = 0.0
    return matrix
