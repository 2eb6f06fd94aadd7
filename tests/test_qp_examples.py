"""Programs that have nothing to do with walking: a portfolio and a cart, from one program each, at many θ."""

from __future__ import annotations

import re
import textwrap

import numpy as np
import pytest
from pydrake.solvers import MathematicalProgram
from qp_programs import uncompiled

from pdhocbf_drake import qp as room
from pdhocbf_drake.qp import compile_program, make_solver


def portfolio() -> tuple[MathematicalProgram, np.ndarray, np.ndarray]:
    """Shares w of four assets, the least variance with a given return θ_0 and at most θ_1 in one asset."""
    random = np.random.default_rng(4)
    factors, returns = random.normal(size=(4, 3)), np.array([0.02, 0.05, 0.08, 0.11])
    prog = MathematicalProgram()
    w, theta = prog.NewContinuousVariables(4, "share"), prog.NewContinuousVariables(2, "theta")
    prog.AddQuadraticCost(factors @ factors.T + 0.1 * np.eye(4), np.zeros(4), w)
    prog.AddLinearEqualityConstraint(np.ones((1, 4)), [1.0], w)
    prog.AddLinearConstraint(np.array([[*returns, -1.0]]), [0.0], [np.inf], np.append(w, theta[0]))
    prog.AddBoundingBoxConstraint(0.0, np.inf, w)
    prog.AddLinearConstraint(np.hstack([np.eye(4), -np.ones((4, 1))]), [-np.inf] * 4, [0.0] * 4, np.append(w, theta[1]))
    return prog, w, theta


def cart() -> tuple[MathematicalProgram, np.ndarray, np.ndarray]:
    """Accelerations w that bring a cart at θ = [position, velocity] to 0; beyond 0.3 m of it is paid for."""
    prog = MathematicalProgram()
    w, slack, theta = (prog.NewContinuousVariables(n, name) for n, name in ((12, "w"), (12, "slack"), (2, "theta")))
    position, velocity = theta
    for acceleration, s in zip(w, slack, strict=True):
        velocity += 0.1 * acceleration
        position += 0.1 * velocity
        prog.AddQuadraticCost(position**2 + 0.1 * velocity**2 + 0.01 * acceleration**2, is_convex=True)
        prog.AddLinearConstraint(position + s >= -0.3)
        prog.AddQuadraticCost(5.0 * s + 50.0 * s**2, is_convex=True)
    prog.AddBoundingBoxConstraint(0.0, np.inf, slack)
    prog.AddBoundingBoxConstraint(-1.0, 1.0, w).evaluator().set_description("acceleration")
    return prog, np.concatenate([w, slack]), theta


@pytest.mark.parametrize(
    ("program", "bound_rows", "thetas"),
    [
        (portfolio, [], [[0.03, 1.0], [0.07, 0.6], [0.09, 0.5], [0.1, 0.9]]),
        (cart, ["acceleration"], [[0.0, 0.0], [0.2, -0.1], [0.4, -1.5], [-0.5, 0.3]]),
    ],
)
def test_compiled_solvers_agree_with_the_program_as_it_was_written(program, bound_rows, thetas) -> None:  # type: ignore[no-untyped-def]
    prog, w, theta = program()
    qp = compile_program(prog, w, theta)
    solvers = [make_solver(name, qp, bound_rows) for name in ("daqp", "clarabel")]
    guess = None
    for at in np.array(thetas):
        expected, cost = uncompiled(prog, w, theta, at)
        results = [solver.solve(at, guess) for solver in solvers]
        for result in results:
            assert result.status == "optimal"
            np.testing.assert_allclose(result.decisions, expected, atol=1e-5)
            assert result.cost == pytest.approx(cost, abs=1e-7)
        guess = results[0].active


@pytest.mark.parametrize("name", ["daqp", "clarabel"])
def test_what_can_not_be_met_is_infeasible(name: str) -> None:
    solver = make_solver(name, compile_program(*portfolio()))
    assert solver.solve(np.array([0.2, 1.0])).infeasible  # more than the best asset returns


def test_the_example_of_the_docstring_runs() -> None:
    code = re.search(r"\n\n(    prog = .*?)\n\n", room.__doc__ or "", re.DOTALL)
    assert code is not None
    names: dict = {"np": np, "MathematicalProgram": MathematicalProgram, **vars(room)}
    exec(textwrap.dedent(code[1]), names)
    assert names["result"].status == "optimal"


def test_every_public_name_is_there() -> None:
    assert all(hasattr(room, name) for name in room.__all__)
