"""Parametric quadratic programs: written once as a Drake `MathematicalProgram`, compiled, solved at many θ.

    min ½ wᵀP w + f(θ)ᵀw + constant(θ)    s.t.    lower(θ) ≤ A w ≤ upper(θ),    f, lower and upper affine in θ

Write the parameters as variables of the program beside the decisions, and say which are which when compiling. To bring
a cart at θ = [position, velocity] to rest at 0, with accelerations w of five ticks of 0.1 s:

    prog = MathematicalProgram()
    w, theta = prog.NewContinuousVariables(5, "w"), prog.NewContinuousVariables(2, "theta")
    position, velocity = theta
    for acceleration in w:
        position, velocity = position + 0.1 * velocity, velocity + 0.1 * acceleration
        prog.AddQuadraticCost(position**2 + 0.1 * velocity**2 + 0.01 * acceleration**2, is_convex=True)
    prog.AddBoundingBoxConstraint(-1.0, 1.0, w).evaluator().set_description("acceleration")
    solver = make_solver("daqp", compile_program(prog, w, theta), bound_rows=["acceleration"])
    result = solver.solve(np.array([0.2, -0.1]))  # a few µs; `ok`, `decisions`, `cost`, `active`, `status`
    result = solver.solve(np.array([0.1, -0.2]), guess=result.active)  # the active set of the last solve as a start

`compile_program` refuses what is not of this form by the description of the cost or constraint. `make_solver` chooses
DAQP (active set, exact to rounding) or Clarabel (interior point, independent); both answer with a `QpResult`.
"""

from pdhocbf_drake.qp.affine_map import AffineMap, QuadraticForm
from pdhocbf_drake.qp.compiler import compile_program
from pdhocbf_drake.qp.daqp_library import has_daqp
from pdhocbf_drake.qp.daqp_solver import DaqpQp
from pdhocbf_drake.qp.parametric_qp import ParametricQp, QpResult
from pdhocbf_drake.qp.solvers import ClarabelQp, QpSolver, make_solver

__all__ = [
    "AffineMap",
    "ClarabelQp",
    "DaqpQp",
    "ParametricQp",
    "QpResult",
    "QpSolver",
    "QuadraticForm",
    "compile_program",
    "has_daqp",
    "make_solver",
]
