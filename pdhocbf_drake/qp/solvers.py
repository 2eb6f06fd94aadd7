"""The choice of a solver: DAQP, or Clarabel through Drake, which also stands in where DAQP is not installed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from pydrake.solvers import (
    ClarabelSolver,
    LinearConstraint,
    MathematicalProgram,
    QuadraticCost,
    SolutionResult,
    SolverOptions,
)

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp.daqp_library import has_daqp
from pdhocbf_drake.qp.daqp_solver import DaqpQp, solve_both
from pdhocbf_drake.qp.parametric_qp import ParametricQp, QpResult

_ACTIVE_MARGIN = 1e-7  # a row this near to its bound counts as active


class QpSolver(Protocol):
    """Solves one `ParametricQp` at many θ. A solve that fails is no exception but a result that is not `ok`."""

    def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult: ...


def make_solver(
    name: str, qp: ParametricQp, bound_rows: Sequence[str] = (), guess_rows: np.ndarray | None = None
) -> QpSolver:
    """A solver of `qp`.

    Args:
        name: "daqp" or "clarabel"; where daqp is not installed, both mean Clarabel.
        qp: the compiled program.
        bound_rows, guess_rows: see `DaqpQp`; Clarabel ignores them.

    Raises:
        InputError: there is no solver of that name, or as `DaqpQp`.
    """
    if name not in ("daqp", "clarabel"):
        raise InputError(f"solver {name!r}: choose daqp or clarabel")
    return DaqpQp(qp, bound_rows, guess_rows) if name == "daqp" and has_daqp() else ClarabelQp(qp)


def solve_axes(
    solvers: Sequence[QpSolver], theta: Sequence[np.ndarray], guess: Sequence[np.ndarray | None]
) -> tuple[QpResult, QpResult]:
    """What two solvers, which may be the same, answer at a θ and from a guess each; DAQP needs one call for both.

    Raises:
        InputError: as their `solve`.
    """
    first, second = solvers
    if isinstance(first, DaqpQp) and isinstance(second, DaqpQp):
        return solve_both(first, second, theta, guess)
    return first.solve(theta[0], guess[0]), second.solve(theta[1], guess[1])


class ClarabelQp:
    """Solves a `ParametricQp` at many θ by Clarabel, with one `MathematicalProgram` whose vectors are updated.

    Its interior-point method is independent of DAQP's and serves as a second opinion.
    """

    def __init__(self, qp: ParametricQp) -> None:
        self.qp = qp
        self._prog = MathematicalProgram()
        self._w = self._prog.NewContinuousVariables(len(qp.P), "w")
        self._cost: QuadraticCost = self._prog.AddQuadraticCost(
            qp.P, qp.linear.offset, self._w, is_convex=True
        ).evaluator()
        wide = np.full(len(qp.A), np.inf)
        self._rows: LinearConstraint = self._prog.AddLinearConstraint(qp.A, -wide, wide, self._w).evaluator()
        self._solver = ClarabelSolver()
        self._options = SolverOptions()
        for option in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
            self._options.SetOption(ClarabelSolver.id(), option, 1e-10)

    def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult:
        """Solves at θ; an interior-point method makes no use of a guessed active set.

        Raises:
            InputError: θ has another length than the parameters.
        """
        del guess
        f, low, high = self.qp.vectors(theta)
        if np.any(low > high + 1e-12):
            return self._failure(True, "infeasible: a lower bound is above its upper bound")
        self._cost.UpdateCoefficients(self.qp.P, f, 0.0, is_convex=True)
        self._rows.UpdateLowerBound(np.minimum(low, high))
        self._rows.UpdateUpperBound(high)
        result = self._solver.Solve(self._prog, None, self._options)
        if not result.is_success():
            status = result.get_solution_result()
            return self._failure(status == SolutionResult.kInfeasibleConstraints, str(status))
        w = result.GetSolution(self._w)
        values = self.qp.A @ w
        active = (values > high - _ACTIVE_MARGIN).astype(float) - (values < low + _ACTIVE_MARGIN)
        cost = result.get_optimal_cost() + self.qp.constant(theta)
        return QpResult(True, w, cost, active, False, "optimal")

    def _failure(self, infeasible: bool, status: str) -> QpResult:
        m, n = self.qp.A.shape
        return QpResult(False, np.zeros(n), np.nan, np.zeros(m), infeasible, status)
