"""The compiled quadratic program behind a persistent DAQP workspace, warm-started by an active set."""

from __future__ import annotations

from collections.abc import Sequence

import daqp
import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.compiled import ParametricQp
from pdhocbf_drake.mpc.solution import QpResult

_ACTIVE, _LOWER, _EQUALITY = 1, 2, 5
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

    The rows named in `bound_rows` are taken as new variables y = M w, so that they become simple bounds, which the
    active-set method handles at no cost; M must be square and invertible. Without them w itself is used.

    Raises:
        InputError: the bound rows don't form an invertible square matrix.
    """

    def __init__(self, qp: ParametricQp, bound_rows: Sequence[str] = ()) -> None:
        self.qp = qp
        n = len(qp.q)
        bound = np.array([name in bound_rows for name in qp.names], dtype=bool)
        if bound_rows and bound.sum() != n:
            raise InputError(
                f"bound rows {list(bound_rows)}: {n} rows are needed, one a decision (given: {bound.sum()})"
            )
        self._order = np.concatenate([np.flatnonzero(bound), np.flatnonzero(~bound)])
        M = qp.A[bound] if bound_rows else np.eye(n)
        self._from_y = np.linalg.inv(M)
        if not np.all(np.isfinite(self._from_y)) or np.linalg.cond(M) > 1e12:
            raise InputError(f"bound rows {list(bound_rows)}: they don't form an invertible matrix")
        W = self._from_y
        hessian = W.T @ qp.P @ W
        rows = np.ascontiguousarray(qp.A[~bound] @ W)
        # One product gives all three vectors: [f; lower; upper] = offset + map θ.
        self._map = np.vstack([W.T @ qp.Q, qp.lower_map[self._order], qp.upper_map[self._order]])
        self._offset = np.concatenate([W.T @ qp.q, qp.lower[self._order], qp.upper[self._order]])
        self._n, self._m = n, len(self._order)
        at_start = self._offset
        f, low, high = at_start[:n], at_start[n : n + self._m], at_start[n + self._m :]
        equal = (qp.lower == qp.upper) & np.all(qp.lower_map == qp.upper_map, axis=1)
        self._sense = np.where(equal[self._order], _EQUALITY, 0).astype(np.int32)
        self._model = daqp.Model()
        self._model.settings = _SETTINGS
        # Bounds at θ = 0 may contradict each other (a step's limits, say), so set up with open ones.
        wide = np.where(self._sense == _EQUALITY, 0.0, 1e30)
        self._model.setup(0.5 * (hessian + hessian.T), f.copy(), rows, wide, -wide, self._sense.copy())
        self._f, self._low, self._high = f.copy(), low.copy(), high.copy()

    def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult:
        """Solves at θ from the guessed active set (flags as in `QpResult.active`, original row order)."""
        qp = self.qp
        vectors = self._offset + self._map @ theta
        n, m = self._n, self._m
        sense = self._sense
        if guess is not None:
            flags = guess[self._order]
            sense = np.where((flags != 0) & (sense == 0), np.where(flags < 0, _ACTIVE | _LOWER, _ACTIVE), sense).astype(
                np.int32
            )
        low, high = vectors[n : n + m], vectors[n + m :]
        if np.any(low > high + 1e-12):
            nothing = np.zeros(n)
            return QpResult(
                False, nothing, np.nan, np.zeros(m), True, "infeasible: a lower bound is above its upper bound"
            )
        self._model.update(f=vectors[:n], bupper=high, blower=low, sense=sense)
        y, cost, flag, info = self._model.solve()
        active = np.zeros(m)
        active[self._order] = np.sign(info["lam"])
        ok = flag == 1
        total = cost + qp.constant(theta)
        word = "optimal" if ok else _WORDS.get(flag, f"exit {flag}")
        return QpResult(ok, self._from_y @ y, total, active, flag == -1, word)
