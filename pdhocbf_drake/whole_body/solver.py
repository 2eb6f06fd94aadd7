"""Quadratic programs whose matrices are new in each tick: by DAQP, or by Drake's Clarabel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram, SolverOptions

try:
    import daqp
except ImportError:
    daqp = None

_TOLERANCE = 1e-10
_CLOSE, _SCALE = 1e-12, 100.0  # of Clarabel: tolerance, and factor of the cost, which is small near an optimum
_INFEASIBLE = -1  # DAQP's flag
_NONE = 1e30  # a bound that is none, for DAQP


class Program(NamedTuple):
    """min ½ yᵀH y + cᵀy  subject to  low ≤ [y; R y] ≤ high.

    The compiler in `qp` serves programs with constant matrices; here R changes with the posture.

    Attributes:
        hessian: H (n, n). linear: c (n,). rows: R (m, n).
        low, high: bounds of the decisions, then of the rows (n + m,).
    """

    hessian: np.ndarray
    linear: np.ndarray
    rows: np.ndarray
    low: np.ndarray
    high: np.ndarray


def solve(program: Program) -> np.ndarray | None:
    """The optimum y (n,), by DAQP, or by Clarabel where that is missing or gives up; None where there is none."""
    if daqp is None:
        return solve_with_clarabel(program)
    flag, y = _daqp(program)
    return y if flag > 0 else None if flag == _INFEASIBLE else solve_with_clarabel(program)


def solve_with_daqp(program: Program) -> np.ndarray | None:
    """The optimum, by DAQP's dual active-set method."""
    flag, y = _daqp(program)
    return y if flag > 0 else None


def _daqp(program: Program) -> tuple[int, np.ndarray]:
    """DAQP's flag, 0 for an answer that is not finite, and y."""
    hessian, linear, rows, low, high = program
    high, low = np.minimum(high, _NONE), np.maximum(low, -_NONE)
    senses = np.zeros(len(low), dtype=np.int32)
    tolerance = {"primal_tol": _TOLERANCE, "dual_tol": _TOLERANCE}
    y, _, flag, _ = daqp.solve(hessian, linear, np.ascontiguousarray(rows), high, low, senses, **tolerance)
    return (flag if np.isfinite(y).all() else 0), y


def solve_with_clarabel(program: Program) -> np.ndarray | None:
    """The optimum, by Drake's interior-point solver."""
    hessian, linear, rows, low, high = program
    prog = MathematicalProgram()
    y = prog.NewContinuousVariables(len(linear))
    prog.AddQuadraticCost(_SCALE * hessian, _SCALE * linear, y, is_convex=True)
    prog.AddLinearConstraint(np.vstack([np.eye(len(linear)), rows]), low, high, y)
    options = SolverOptions()
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        options.SetOption(ClarabelSolver.id(), name, _CLOSE)
    result = ClarabelSolver().Solve(prog, None, options)
    return np.asarray(result.GetSolution(y)) if result.is_success() else None
