"""Other QP solvers, called directly, where they are installed (the extra `bench`)."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import numpy as np

from pdhocbf_drake.qp import ParametricQp
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.studies.bench.routes import Qps, Route

ACCURACY = 1e-9
"""Tolerance of these solvers; DAQP and Clarabel have one that is at least as tight."""
_FAR = 1e20  # stands for infinity


def _finite(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.maximum(low, -_FAR), np.minimum(high, _FAR)


class Piqp(Route):
    """PIQP's sparse interior-point method on the sparse program."""

    name = "PIQP"

    def _set_up(self, qp: ParametricQp) -> Any:
        import piqp
        from scipy.sparse import csc_matrix

        equal = _equalities(qp)
        solver = piqp.SparseSolver()
        solver.settings.eps_abs = solver.settings.eps_rel = ACCURACY
        f = qp.linear.offset
        A, G = csc_matrix(qp.A[equal]), csc_matrix(qp.A[~equal])
        # A bound that is infinite here is left out by PIQP for good.
        low, high = (bound.offset[~equal] for bound in (qp.lower, qp.upper))
        solver.setup(csc_matrix(qp.P), f, A, np.zeros(A.shape[0]), G, low, high)
        return solver, equal

    def _solve(self, ready: Any, f: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        solver, equal = ready
        solver.update(c=f, b=low[equal], h_l=low[~equal], h_u=high[~equal])
        solver.solve()
        return np.array(solver.result.x)


class ProxQp(Route):
    """ProxQP's dense augmented-Lagrangian method on our condensed program."""

    name = "ProxQP"

    def __init__(self, walk: Walk, qps: Qps) -> None:
        super().__init__(walk, walk.mpc.qps)

    def _set_up(self, qp: ParametricQp) -> Any:
        from proxsuite import proxqp

        equal = _equalities(qp)
        solver = proxqp.dense.QP(len(qp.P), int(equal.sum()), int((~equal).sum()))
        solver.settings.eps_abs, solver.settings.eps_rel = ACCURACY, 0.0
        low, high = _finite(qp.lower.offset[~equal], qp.upper.offset[~equal])
        solver.init(qp.P, qp.linear.offset, qp.A[equal], np.zeros(int(equal.sum())), qp.A[~equal], low, high)
        return solver, equal

    def _solve(self, ready: Any, f: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        solver, equal = ready
        lower, upper = _finite(low[~equal], high[~equal])
        solver.update(H=None, g=f, A=None, b=low[equal], C=None, l=lower, u=upper)
        solver.solve()
        return np.array(solver.results.x)


class Osqp(Route):
    """OSQP on the sparse program, from the last solution of that phase; its default accuracy is too low."""

    name = "OSQP"

    def _set_up(self, qp: ParametricQp) -> Any:
        import osqp
        from scipy.sparse import csc_matrix

        solver = osqp.OSQP()
        low, high = _finite(qp.lower.offset, qp.upper.offset)
        solver.setup(
            csc_matrix(qp.P), qp.linear.offset, csc_matrix(qp.A), low, high, verbose=False,
            eps_abs=1e-7, eps_rel=1e-7, max_iter=4_000, polishing=True,
        )  # fmt: skip
        return solver

    def _solve(self, ready: Any, f: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        lower, upper = _finite(low, high)
        ready.update(q=f, l=lower, u=upper)
        return np.array(ready.solve(raise_error=False).x)


def _equalities(qp: ParametricQp) -> np.ndarray:
    """Which rows have one value as lower and upper bound, whatever θ."""
    return np.array((qp.lower.offset == qp.upper.offset) & np.all(qp.lower.matrix == qp.upper.matrix, axis=1))


def installed() -> list[type[Route]]:
    """The routes whose solver is installed."""
    if find_spec("scipy") is None:
        return []
    known: dict[str, type[Route]] = {"piqp": Piqp, "proxsuite": ProxQp, "osqp": Osqp}
    return [route for module, route in known.items() if find_spec(module) is not None]
