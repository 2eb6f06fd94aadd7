"""The compiled quadratic program behind a persistent DAQP workspace, warm-started by an active set."""

from __future__ import annotations

import math
from collections.abc import Sequence

import daqp
import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.jit import compiled
from pdhocbf_drake.mpc.affine_map import AffineMap, write_affine
from pdhocbf_drake.mpc.compiled import ParametricQp
from pdhocbf_drake.mpc.quadratic_form import QuadraticForm, quadratic_value
from pdhocbf_drake.mpc.slacks import Slacks, find_slacks
from pdhocbf_drake.mpc.solution import QpResult

_EQUALITY, _SOFT = 5, 8
_SETTINGS = {"primal_tol": 1e-10, "dual_tol": 1e-10, "iter_limit": 2000}
_INFEASIBLE, _OPTIMAL, _SOFTENED, _DEPENDENT = -1, 1, 2, -6
_WORDS = {
    -1: "infeasible",
    -2: "cycling",
    -3: "unbounded",
    -4: "iteration limit",
    -5: "not convex",
    -6: "overdetermined set",
}
_NOISE = 1e-13  # entries of M⁻¹ below this part of the largest one are what rounding left of zeros


class DaqpQp:
    """Solves a `ParametricQp` at many θ.

    Slacks that soften one row each (`find_slacks`) are left to DAQP, which prices a violated row by itself, so that
    a row that is kept costs nothing. Of the other decisions w the solver sees y = M (w − w°(θ)):

    - w° = −P⁻¹ f(θ) is the optimum without constraints, so that the linear cost vanishes, and with it the work
      that it would make;
    - M holds the rows named in `bound_rows`, square and invertible, so that they become simple bounds on y, which an
      active-set method handles at no cost. Without bound rows M = 1.

    Attributes:
        core_seconds, iterations: what DAQP says of its last solve, on its own clock [s].

    Raises:
        InputError: the bound rows don't form an invertible square matrix, or P is singular.
    """

    def __init__(self, qp: ParametricQp, bound_rows: Sequence[str] = (), guess_rows: np.ndarray | None = None) -> None:
        """
        Args:
            qp: the compiled program.
            bound_rows: names of the rows that are taken as variables.
            guess_rows: for each row, the row of the last tick's program whose activity is its guess; else the same row.
        """
        self.qp, self.core_seconds, self.iterations = qp, 0.0, 0
        slacks = find_slacks(qp)
        hard = np.setdiff1d(np.arange(len(qp.P)), slacks.columns)
        left = np.setdiff1d(np.arange(len(qp.A)), slacks.bounds)
        is_bound = np.array([qp.names[row] in bound_rows for row in left], dtype=bool)
        if bound_rows and is_bound.sum() != len(hard):
            raise InputError(
                f"bound rows {list(bound_rows)}: {len(hard)} rows are needed, one a decision (given: {is_bound.sum()})"
            )
        order = np.concatenate([left[is_bound], left[~is_bound]])
        self._guess_from = order if guess_rows is None else guess_rows[order]
        A, P = qp.A[np.ix_(order, hard)], qp.P[np.ix_(hard, hard)]
        bounds = int(is_bound.sum())
        W = _inverse(A[:bounds], bound_rows) if bound_rows else np.eye(len(hard))
        rows = A[bounds:] @ W
        f, F = qp.linear.offset[hard], qp.linear.matrix[hard]
        w, w_map = _unconstrained_optimum(P, f, F)
        self._centre = _centre_of_all(len(qp.P), hard, w, w_map).arrays
        w_of_y = AffineMap(np.zeros(len(hard)), W)
        curvature = np.diag(P)[:, None].copy() if np.count_nonzero(P) == np.count_nonzero(np.diag(P)) else P
        self._size, self._way_back = len(hard), (*w_of_y.arrays[1:], curvature, hard, order)
        self._value = _value_at_optimum(qp.constant, f, F, w, w_map).arrays

        # Bounds of A (w − w°), lower then upper: one map into one array, whose halves the solver reads.
        bounds_map = _stacked_bounds(qp, order, A @ w, A @ w_map)
        self._bounds, self._limits = bounds_map.arrays, bounds_map.offset.copy()
        self._low, self._high = np.split(self._limits, 2)
        changes = np.split(bounds_map.matrix, 2)
        equal = (self._low == self._high) & np.all(changes[0] == changes[1], axis=1)
        self._cold = np.where(equal, _EQUALITY, np.where(np.isin(order, slacks.rows), _SOFT, 0)).astype(np.int32)
        self._sense = self._cold.copy()
        self._model = self._set_up(W.T @ P @ W, np.ascontiguousarray(rows))
        self._soften(slacks, order, rows, bounds)

    def _set_up(self, hessian: np.ndarray, rows: np.ndarray) -> daqp.Model:
        model = daqp.Model()
        model.settings = _SETTINGS
        # Bounds at θ = 0 may contradict each other (a step's limits, say), so set up with open ones.
        wide = np.where(self._cold == _EQUALITY, 0.0, 1e30)
        flag, _ = model.setup(0.5 * (hessian + hessian.T), None, rows, wide, -wide, self._cold)
        if flag < 0:
            raise InputError(f"the compiled program can't be set up in DAQP: {_WORDS.get(flag, f'exit {flag}')}")
        return model

    def _soften(self, slacks: Slacks, order: np.ndarray, rows: np.ndarray, bounds: int) -> None:
        self._slacks = slacks
        at = np.argsort(order)[np.searchsorted(np.sort(order), slacks.rows)]
        self._soft, self._soft_rows = at, rows[at - bounds]
        if len(at):
            rho, linear = np.zeros(len(order)), np.zeros(len(order))
            rho[at], linear[at] = 1.0 / slacks.quadratic, slacks.linear
            self._model.soft_weights(rho_l=rho, rho_u=rho, w_l=linear, w_u=linear)

    def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult:
        """Solves at θ, starting from the active set guessed by the last tick's `QpResult.active`."""
        write_affine(*self._bounds, theta, self._limits)
        flag, y, multipliers = self._run(self._cold if guess is None else self._guessed(guess))
        if flag < 0 and guess is not None:  # a guess must never change the answer
            flag, y, multipliers = self._run(self._cold)
        return self._answer(theta, flag, y, multipliers)

    def _answer(self, theta: np.ndarray, flag: int, y: np.ndarray, multipliers: np.ndarray) -> QpResult:
        decisions, active = np.empty(len(self.qp.P)), np.zeros(len(self.qp.A))
        write_affine(*self._centre, theta, decisions)
        cost = quadratic_value(*self._value, theta)
        cost += move_from_centre(*self._way_back, y, multipliers, decisions, active)
        if flag == _SOFTENED:
            slack = np.maximum(0.0, self._low[self._soft] - self._soft_rows @ y)
            decisions[self._slacks.columns] = slack
            cost += float(slack @ (self._slacks.linear + 0.5 * self._slacks.quadratic * slack))
        word = "optimal" if flag > 0 else _WORDS.get(flag, f"exit {flag}")
        return QpResult(flag > 0, decisions, cost, active, flag == _INFEASIBLE, word)

    def _guessed(self, guess: np.ndarray) -> np.ndarray:
        write_senses(guess, self._guess_from, self._cold, self._sense)
        return self._sense

    def _run(self, sense: np.ndarray) -> tuple[int, np.ndarray, np.ndarray]:
        """Exit flag, y and multipliers at the present limits."""
        flag = self._model.update(bupper=self._high, blower=self._low, sense=sense)
        if flag < 0:
            return flag, np.zeros(self._size), np.zeros(len(sense))
        y, _, flag, info = self._model.solve()
        self.core_seconds, self.iterations = info["solve_time"], info["iterations"]
        if flag > 0 and not math.isfinite(y.sum()):
            # DAQP calls this optimal: its guess held rows that depend on each other.
            return _DEPENDENT, np.zeros(len(y)), np.zeros(len(sense))
        return flag, y, info["lam"]


@compiled
def write_senses(guess: np.ndarray, source: np.ndarray, cold: np.ndarray, out: np.ndarray) -> None:
    """Flags +1 upper, −1 lower, 0 inactive of the rows `source`, as DAQP wants them beside what rows always are."""
    for row in range(len(cold)):
        flag = guess[source[row]]
        out[row] = cold[row]
        if cold[row] != 5:  # an equality is always active
            out[row] |= 1 if flag > 0.0 else 3 if flag < 0.0 else 0


@compiled
def move_from_centre(
    starts: np.ndarray, columns: np.ndarray, values: np.ndarray, curvature: np.ndarray, hard: np.ndarray,
    order: np.ndarray, y: np.ndarray, multipliers: np.ndarray, decisions: np.ndarray, active: np.ndarray,
) -> float:  # fmt: skip
    """Adds M⁻¹ y to the hard decisions, fills in the flags, and gives what the cost grows by: ½ |M⁻¹ y|²_P."""
    away = np.empty(len(hard))
    for i in range(len(hard)):
        total = 0.0
        for k in range(starts[i], starts[i + 1]):
            total += values[k] * y[columns[k]]
        away[i] = total
        decisions[hard[i]] += total
    for row in range(len(order)):
        if multipliers[row] != 0.0:
            active[order[row]] = 1.0 if multipliers[row] > 0.0 else -1.0
    cost = 0.0
    if curvature.shape[1] == 1:  # P is diagonal
        for i in range(len(hard)):
            cost += 0.5 * curvature[i, 0] * away[i] * away[i]
    else:
        for i in range(len(hard)):
            for j in range(len(hard)):
                cost += 0.5 * away[i] * curvature[i, j] * away[j]
    return cost


def _unconstrained_optimum(P: np.ndarray, f: np.ndarray, F: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """w°(θ) = −P⁻¹ (f + F θ): offset and matrix."""
    try:
        optimum = -np.linalg.solve(P, np.column_stack([f, F]))
    except np.linalg.LinAlgError:
        raise InputError(
            "the cost is not strictly convex in the decisions, as DAQP needs it: choose clarabel"
        ) from None
    return optimum[:, 0], optimum[:, 1:]


def _value_at_optimum(
    constant: QuadraticForm, f: np.ndarray, F: np.ndarray, w: np.ndarray, w_map: np.ndarray
) -> QuadraticForm:
    """The cost at w°(θ): what the cost of y comes on top of."""
    shown = np.flatnonzero(F.any(axis=0))
    matrix, vector = np.zeros((F.shape[1], F.shape[1])), np.zeros(F.shape[1])
    matrix[np.ix_(shown, shown)] = F[:, shown].T @ w_map[:, shown]
    vector[shown] = 0.5 * (F[:, shown].T @ w + w_map[:, shown].T @ f)
    return constant.plus(matrix, vector, 0.5 * f @ w)


def _centre_of_all(size: int, hard: np.ndarray, w: np.ndarray, w_map: np.ndarray) -> AffineMap:
    """w°(θ) among all decisions, where slacks are zero."""
    offset, matrix = np.zeros(size), np.zeros((size, w_map.shape[1]))
    offset[hard], matrix[hard] = w, w_map
    return AffineMap(offset, matrix)


def _inverse(rows: np.ndarray, bound_rows: Sequence[str]) -> np.ndarray:
    try:
        inverse = np.linalg.inv(rows)
    except np.linalg.LinAlgError:
        inverse = np.full(rows.shape, np.inf)
    if not np.abs(inverse).max() * np.abs(rows).max() < 1e12:
        raise InputError(f"bound rows {list(bound_rows)}: they don't form an invertible matrix")
    return _cleaned(inverse)


def _stacked_bounds(qp: ParametricQp, order: np.ndarray, shift: np.ndarray, shift_map: np.ndarray) -> AffineMap:
    """Lower, then upper bounds of the rows in `order`, less what the rows are at w°."""
    offsets = [bound.offset[order] for bound in (qp.lower, qp.upper)]
    maps = [bound.matrix[order] - shift_map for bound in (qp.lower, qp.upper)]
    for offset, matrix in zip(offsets, maps, strict=True):
        matrix[np.isinf(offset)] = 0.0
    return AffineMap(np.concatenate([offset - shift for offset in offsets]), _cleaned(np.vstack(maps)))


def _cleaned(matrix: np.ndarray) -> np.ndarray:
    size = np.abs(matrix)
    matrix[size < _NOISE * size.max(initial=0.0)] = 0.0
    return matrix
