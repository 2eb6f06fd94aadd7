"""The compiled quadratic program behind a persistent DAQP workspace, warm-started by an active set."""

from __future__ import annotations

from collections.abc import Sequence

import daqp
import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.compiled import ParametricQp
from pdhocbf_drake.mpc.slacks import find_slacks
from pdhocbf_drake.mpc.solution import QpResult

_ACTIVE, _LOWER, _EQUALITY, _SOFT = 1, 2, 5, 8
_SETTINGS = {"primal_tol": 1e-10, "dual_tol": 1e-10, "iter_limit": 2000}
_WORDS = {
    -1: "infeasible",
    -2: "cycling",
    -3: "unbounded",
    -4: "iteration limit",
    -5: "not convex",
    -6: "overdetermined set",
}


class DaqpQp:
    """Solves a `ParametricQp` at many θ.

    Slacks that soften one row each (`find_slacks`) are left to DAQP, which prices a violated row by itself, so that
    a row that is kept costs nothing. The rows named in `bound_rows` are taken as new variables y = M w, so that they
    become simple bounds, which the active-set method handles at no cost; M must be square and invertible. Without
    them w itself is used.

    Raises:
        InputError: the bound rows don't form an invertible square matrix.
    """

    def __init__(self, qp: ParametricQp, bound_rows: Sequence[str] = ()) -> None:
        self.qp = qp
        slacks = find_slacks(qp)
        self._hard = np.setdiff1d(np.arange(len(qp.q)), slacks.columns)
        self._slack_columns, self._soft_rows = slacks.columns, slacks.rows
        rows_left = np.setdiff1d(np.arange(len(qp.A)), slacks.bounds)
        n = len(self._hard)
        bound = np.array([qp.names[row] in bound_rows for row in rows_left], dtype=bool)
        if bound_rows and bound.sum() != n:
            raise InputError(
                f"bound rows {list(bound_rows)}: {n} rows are needed, one a decision (given: {bound.sum()})"
            )
        self._order = np.concatenate([rows_left[bound], rows_left[~bound]])
        M = qp.A[np.ix_(rows_left[bound], self._hard)] if bound_rows else np.eye(n)
        if np.linalg.cond(M) > 1e12:
            raise InputError(f"bound rows {list(bound_rows)}: they don't form an invertible matrix")
        self._from_y = W = np.linalg.inv(M)
        hessian = W.T @ qp.P[np.ix_(self._hard, self._hard)] @ W
        rows = np.ascontiguousarray(qp.A[np.ix_(rows_left[~bound], self._hard)] @ W)
        # One product gives all three vectors: [f; lower; upper] = offset + map θ.
        self._map = np.vstack([W.T @ qp.Q[self._hard], qp.lower_map[self._order], qp.upper_map[self._order]])
        self._offset = np.concatenate([W.T @ qp.q[self._hard], qp.lower[self._order], qp.upper[self._order]])
        self._n, self._m = n, len(self._order)
        equal = (qp.lower == qp.upper) & np.all(qp.lower_map == qp.upper_map, axis=1)
        soft = np.isin(self._order, slacks.rows)
        self._sense = np.where(equal[self._order], _EQUALITY, np.where(soft, _SOFT, 0)).astype(np.int32)
        self._free = self._sense != _EQUALITY
        self._model = daqp.Model()
        self._model.settings = _SETTINGS
        # Bounds at θ = 0 may contradict each other (a step's limits, say), so set up with open ones.
        wide = np.where(self._sense == _EQUALITY, 0.0, 1e30)
        self._model.setup(0.5 * (hessian + hessian.T), self._offset[:n].copy(), rows, wide, -wide, self._sense.copy())
        if len(slacks.rows):
            place = np.argsort(self._order)[np.searchsorted(np.sort(self._order), slacks.rows)]
            rho, linear = np.zeros(self._m), np.zeros(self._m)
            rho[place], linear[place] = 1.0 / slacks.quadratic, slacks.linear
            self._model.soft_weights(rho_l=rho, rho_u=rho, w_l=linear, w_u=linear)

    def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult:
        """Solves at θ from the guessed active set (flags as in `QpResult.active`, original row order)."""
        qp = self.qp
        vectors = self._offset + self._map @ theta
        n, m = self._n, self._m
        sense = self._sense
        if guess is not None:
            flags = guess[self._order]
            start = np.where(flags < 0, _ACTIVE | _LOWER, _ACTIVE) * ((flags != 0) & self._free)
            sense = (sense | start).astype(np.int32)
        low, high = vectors[n : n + m], vectors[n + m :]
        decisions = np.zeros(len(qp.q))
        active = np.zeros(len(qp.A))
        if np.any(low > high + 1e-12):
            return QpResult(
                False, decisions, np.nan, active, True, "infeasible: a lower bound is above its upper bound"
            )
        self._model.update(f=vectors[:n], bupper=high, blower=low, sense=sense)
        y, cost, flag, info = self._model.solve()
        active[self._order] = np.sign(info["lam"])
        ok = flag in (1, 2)  # 2: optimal with soft rows violated
        decisions[self._hard] = self._from_y @ y
        if len(self._soft_rows):
            values = qp.A[np.ix_(self._soft_rows, self._hard)] @ decisions[self._hard]
            least = qp.lower[self._soft_rows] + qp.lower_map[self._soft_rows] @ theta
            decisions[self._slack_columns] = np.maximum(0.0, least - values)
        word = "optimal" if ok else _WORDS.get(flag, f"exit {flag}")
        return QpResult(ok, decisions, cost + qp.constant(theta), active, flag == -1, word)
