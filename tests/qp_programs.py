"""Parametric programs for the tests of `pdhocbf_drake.qp`, and their answers by Drake without compiling."""

from __future__ import annotations

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram, SolverOptions


def random_program(seed: int, slacks: bool = False) -> tuple[MathematicalProgram, np.ndarray, np.ndarray]:
    """A feasible strictly convex program in 6 decisions and 4 parameters, with rows of every kind."""
    random = np.random.default_rng(seed)
    prog = MathematicalProgram()
    w, theta = prog.NewContinuousVariables(6, "w"), prog.NewContinuousVariables(4, "theta")
    root = random.normal(size=(10, 10))
    prog.AddQuadraticCost(root @ root.T + np.eye(10), random.normal(size=10), np.concatenate([w, theta]))
    prog.AddLinearCost(random.normal(size=3), 0.7, w[:3])
    rows = random.normal(size=(5, 10))
    prog.AddLinearConstraint(rows, -np.full(5, 2.0), np.full(5, np.inf), np.concatenate([w, theta]))
    prog.AddLinearConstraint(-rows[:2, :6], -np.full(2, 3.0), np.full(2, 4.0), w)
    prog.AddLinearEqualityConstraint(random.normal(size=(1, 7)), [0.3], np.concatenate([w, theta[:1]]))
    prog.AddBoundingBoxConstraint(-1.0, 1.0, w).evaluator().set_description("box")
    if slacks:
        slack = prog.NewContinuousVariables(2, "slack")
        softened = np.hstack([random.normal(size=(2, 6)), np.eye(2)])
        prog.AddLinearConstraint(softened, np.full(2, 1.5), np.full(2, np.inf), np.concatenate([w, slack]))
        prog.AddBoundingBoxConstraint(0.0, np.inf, slack)
        prog.AddQuadraticCost(4.0 * np.eye(2), np.full(2, 0.5), slack)
        w = np.concatenate([w, slack])
    return prog, w, theta


def uncompiled(prog: MathematicalProgram, w: np.ndarray, theta: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, float]:
    """The optimum and the cost of the program as it was written, with its parameters held by constraints."""
    copy = prog.Clone()
    copy.AddBoundingBoxConstraint(at, at, theta)
    options = SolverOptions()
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        options.SetOption(ClarabelSolver.id(), name, 1e-11)
    result = ClarabelSolver().Solve(copy, None, options)
    assert result.is_success()
    return result.GetSolution(w), result.get_optimal_cost()
