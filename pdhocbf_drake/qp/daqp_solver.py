"""The compiled quadratic program behind a persistent DAQP workspace, warm-started by an active set."""

from __future__ import annotations

from collections.abc import Sequence

import daqp
import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp.affine_map import AffineMap, compressed
from pdhocbf_drake.qp.compiled import ParametricQp
from pdhocbf_drake.qp.kernels import Sparse, is_finite, write_decisions, write_limits, write_senses
from pdhocbf_drake.qp.merged_rows import somewhere
from pdhocbf_drake.qp.result import QpResult
from pdhocbf_drake.qp.slacks import Slacks, find_slacks

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

    - M holds the rows named in `bound_rows`, square and invertible, so that they become simple bounds on y, which an
      active-set method handles at no cost. Without bound rows M = 1.
    - w° is the optimum without constraints, so that the linear cost vanishes, and with it the work that it would
      make. It is found at each θ from L Lᵀ = M⁻ᵀ P M⁻¹: over a horizon L is banded where P M⁻¹ is full, and reading
      what is full takes longer than solving with what is not.

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
        hard, left = _without(len(qp.P), slacks.columns), _without(len(qp.A), slacks.bounds)
        is_bound = np.array([qp.names[row] in bound_rows for row in left], dtype=bool)
        if bound_rows and is_bound.sum() != len(hard):
            raise InputError(
                f"bound rows {list(bound_rows)}: {len(hard)} rows are needed, one a decision (given: {is_bound.sum()})"
            )
        order = np.concatenate([left[is_bound], left[~is_bound]])
        self._guess_from = order if guess_rows is None else guess_rows[order]
        self._guessed_rows = int(self._guess_from.max(initial=-1)) + 1
        A, P = qp.A[np.ix_(order, hard)], qp.P[np.ix_(hard, hard)]
        bounds = int(is_bound.sum())
        W = _inverse(A[:bounds], bound_rows) if bound_rows else np.eye(len(hard))
        rows, hessian = A[bounds:] @ W, _cleaned(W.T @ P @ W)
        hessian = 0.5 * (hessian + hessian.T)
        gradient = AffineMap(W.T @ qp.linear.offset[hard], _cleaned(W.T @ qp.linear.matrix[hard]))
        lower, upper = qp.lower.rows(order), qp.upper.rows(order)
        own = lower.above(upper)
        root = _root(hessian)
        self._to_limits = (gradient.arrays, own.arrays, root, compressed(_cleaned(rows.copy())), qp.constant.arrays)
        self._way_back = (root, compressed(W), hard, order)
        self._optimum, self._product, self._limits = np.zeros(len(hard)), np.zeros(len(hard)), own.offset.copy()
        self._low, self._high = np.split(self._limits, 2)

        point = somewhere(own.parameters)
        equal = (self._low == self._high) & (lower(point) == upper(point))  # there, and so, but for chance, everywhere
        self._cold = np.where(equal, _EQUALITY, np.where(np.isin(order, slacks.rows), _SOFT, 0)).astype(np.int32)
        self._sense = self._cold.copy()
        self._model = self._set_up(hessian, np.ascontiguousarray(rows))
        self._soften(slacks, order, rows, bounds)

    def _set_up(self, hessian: np.ndarray, rows: np.ndarray) -> daqp.Model:
        model = daqp.Model()
        model.settings = _SETTINGS
        # Bounds at θ = 0 may contradict each other (a step's limits, say), so set up with open ones.
        wide = np.where(self._cold == _EQUALITY, 0.0, 1e30)
        flag, _ = model.setup(hessian, None, rows, wide, -wide, self._cold)
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
        """Solves at θ, starting from the active set guessed by the last tick's `QpResult.active`.

        Raises:
            ValueError: θ is of another length than the parameters, or the guess too short for the rows it is about.
        """
        if len(theta) != self.qp.linear.parameters or (guess is not None and len(guess) < self._guessed_rows):
            # machine code would read beyond them
            raise ValueError(
                f"θ has {self.qp.linear.parameters} entries and a guess {self._guessed_rows} at least, given "
                f"{len(theta)} and {None if guess is None else len(guess)}"
            )
        least = self.prepare(theta)
        flag, y, multipliers = self._run(self._cold if guess is None else self._guessed(guess))
        if flag < 0 and guess is not None:  # a guess must never change the answer
            flag, y, multipliers = self._run(self._cold)
        return self._answer(least, flag, y, multipliers)

    def prepare(self, theta: np.ndarray) -> float:
        """Works out y° and the limits on y at θ; gives what the cost is at w°."""
        return float(write_limits(*self._to_limits, theta, self._optimum, self._limits))

    def _answer(self, least: float, flag: int, y: np.ndarray, multipliers: np.ndarray) -> QpResult:
        decisions, active = np.zeros(len(self.qp.P)), np.zeros(len(self.qp.A))
        cost = least + write_decisions(*self._way_back, self._optimum, y, multipliers, decisions, active, self._product)
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
            return flag, np.zeros(len(self._optimum)), np.zeros(len(sense))
        y, _, flag, info = self._model.solve()
        self.core_seconds, self.iterations = info["solve_time"], info["iterations"]
        if flag > 0 and not is_finite(y):
            # DAQP calls this optimal: its guess held rows that depend on each other.
            return _DEPENDENT, np.zeros(len(y)), np.zeros(len(sense))
        return flag, y, info["lam"]


def _without(count: int, some: np.ndarray) -> np.ndarray:
    """0 … count − 1 without some of them."""
    left = np.ones(count, dtype=bool)
    left[some] = False
    return np.flatnonzero(left)


def _root(hessian: np.ndarray) -> Sparse:
    """L with L Lᵀ = hessian; each row ends with its diagonal."""
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
    size = np.abs(matrix)
    matrix[size < _NOISE * size.max(initial=0.0)] = 0.0
    return matrix
