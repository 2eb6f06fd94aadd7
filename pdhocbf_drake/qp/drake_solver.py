"""The compiled quadratic program through Drake's Clarabel: the independent second opinion."""

from __future__ import annotations

import numpy as np
from pydrake.solvers import (
    ClarabelSolver,
    LinearConstraint,
    MathematicalProgram,
    QuadraticCost,
    SolutionResult,
    SolverOptions,
)

from pdhocbf_drake.qp.compiled import ParametricQp
from pdhocbf_drake.qp.result import QpResult

_ACTIVE_MARGIN = 1e-7


class DrakeQp:
    """Solves a `ParametricQp` at many θ with one program whose vectors are updated."""

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
        for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
            self._options.SetOption(ClarabelSolver.id(), name, 1e-10)

    def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult:
        """Solves at θ; an interior-point method has no use for the guessed active set."""
        del guess
        f, low, high = self.qp.vectors(theta)
        nothing = np.zeros(len(low))
        if np.any(low > high + 1e-12):
            return QpResult(
                False, np.zeros(len(f)), np.nan, nothing, True, "infeasible: a lower bound is above its upper bound"
            )
        self._cost.UpdateCoefficients(self.qp.P, f, 0.0, is_convex=True)
        self._rows.UpdateLowerBound(np.minimum(low, high))
        self._rows.UpdateUpperBound(high)
        result = self._solver.Solve(self._prog, None, self._options)
        status = result.get_solution_result()
        if not result.is_success():
            infeasible = status == SolutionResult.kInfeasibleConstraints
            return QpResult(False, np.zeros(len(f)), np.nan, nothing, infeasible, str(status))
        w = result.GetSolution(self._w)
        values = self.qp.A @ w
        active = (values > high - _ACTIVE_MARGIN).astype(float) - (values < low + _ACTIVE_MARGIN)
        cost = result.get_optimal_cost() + self.qp.constant(theta)
        return QpResult(True, w, cost, active, False, "optimal")
