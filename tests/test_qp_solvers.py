"""Solvers of a compiled program give its optimum, however they are started and whatever they solved before."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.solvers import MathematicalProgram
from qp_programs import random_program, uncompiled

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp import ClarabelQp, DaqpQp, compile_program, make_solver
from pdhocbf_drake.studies.bench.accuracy import reference

Program = tuple[MathematicalProgram, np.ndarray, np.ndarray]
SEEDS = st.integers(0, 10_000)


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, slacks=st.booleans())
def test_both_solvers_find_the_optimum_of_the_program_as_it_was_written(seed: int, slacks: bool) -> None:
    prog, w, theta = random_program(seed, slacks)
    at = 0.1 * np.random.default_rng(seed).normal(size=4)
    expected, cost = uncompiled(prog, w, theta, at)
    qp = compile_program(prog, w, theta)
    for solver in (DaqpQp(qp), DaqpQp(qp, ["box"]), ClarabelQp(qp)):
        result = solver.solve(at)
        assert result.status == "optimal"
        np.testing.assert_allclose(result.decisions, expected, atol=2e-5)
        assert result.cost == pytest.approx(cost, abs=1e-6)


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, slacks=st.booleans())
def test_daqp_is_exact_to_rounding(seed: int, slacks: bool) -> None:
    prog, w, theta = random_program(seed, slacks)
    at = 0.1 * np.random.default_rng(seed).normal(size=4)
    qp = compile_program(prog, w, theta)
    exact, certain = reference(qp, at, uncompiled(prog, w, theta, at)[0])
    assert certain
    for bound_rows in ([], ["box"]):
        np.testing.assert_allclose(DaqpQp(qp, bound_rows).solve(at).decisions, exact, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, guess=st.lists(st.sampled_from([-1.0, 0.0, 1.0]), min_size=20, max_size=20))
def test_a_guess_never_changes_the_answer(seed: int, guess: list[float]) -> None:
    qp = compile_program(*random_program(seed, slacks=True))
    at = 0.1 * np.random.default_rng(seed).normal(size=4)
    cold, warm = DaqpQp(qp).solve(at), DaqpQp(qp).solve(at, np.resize(guess, len(qp.A)))
    assert warm.ok == cold.ok
    np.testing.assert_allclose(warm.decisions, cold.decisions, atol=1e-9)
    assert warm.cost == pytest.approx(cold.cost, abs=1e-9)


def test_an_earlier_solve_never_changes_the_answer() -> None:
    qp = compile_program(*random_program(3))
    used, last = DaqpQp(qp), None
    random = np.random.default_rng(0)
    for _ in range(30):
        at = 0.2 * random.normal(size=4)
        result, fresh = used.solve(at, last), DaqpQp(qp).solve(at)
        assert result.ok == fresh.ok
        if result.ok:
            np.testing.assert_allclose(result.decisions, fresh.decisions, atol=1e-9)
        last = result.active


def test_the_active_set_of_a_result_is_the_best_guess_for_the_same_problem() -> None:
    qp = compile_program(*random_program(5))
    solver, at = DaqpQp(qp), np.array([1.0, -0.9, 0.8, 0.7])
    cold = solver.solve(at)
    assert np.count_nonzero(cold.active) > 2
    needed = solver.iterations
    solver.solve(at, cold.active)
    assert solver.iterations < needed


def test_guess_rows_say_which_row_of_the_guess_is_meant() -> None:
    qp = compile_program(*random_program(5))
    at, rows = np.array([1.0, -0.9, 0.8, 0.7]), np.random.default_rng(0).permutation(len(qp.A))
    plain, permuted = DaqpQp(qp), DaqpQp(qp, guess_rows=rows)
    active = plain.solve(at).active
    guess = np.empty(len(qp.A))
    guess[rows] = active
    plain.solve(at, active)
    permuted.solve(at, guess)
    assert permuted.iterations == plain.iterations


def test_a_parameter_or_a_guess_of_another_length_is_refused() -> None:
    qp = compile_program(*random_program(0))
    solver = DaqpQp(qp)
    with pytest.raises(InputError, match=r"θ must have shape \(4,\), given \(3,\)"):
        solver.solve(np.zeros(3))
    with pytest.raises(InputError, match=f"a guess must have {len(qp.A)} entries at least, given {len(qp.A) - 1}"):
        solver.solve(np.zeros(4), np.zeros(len(qp.A) - 1))


def softened(linear: float, row: list[float], sign: float) -> Program:
    """min ½ |w|² + linear s + s²  s.t.  row·w + s ≥ θ (times the sign), s ≥ 0 and w_1 ≤ 5; the first and the last are
    named "simple".
    """
    prog = MathematicalProgram()
    w, s, theta = (prog.NewContinuousVariables(n, name) for n, name in ((2, "w"), (1, "s"), (1, "theta")))
    prog.AddQuadraticCost(np.eye(2), np.zeros(2), w)
    prog.AddQuadraticCost(2.0 * np.eye(1), [linear], s)
    low, high = ([0.0], [np.inf]) if sign > 0.0 else ([-np.inf], [0.0])
    soft = prog.AddLinearConstraint(sign * np.array([[*row, 1.0, -1.0]]), low, high, np.concatenate([w, s, theta]))
    soft.evaluator().set_description("simple")
    prog.AddLinearConstraint(np.array([[0.0, 1.0]]), [-np.inf], [5.0], w).evaluator().set_description("simple")
    prog.AddBoundingBoxConstraint(0.0, np.inf, s)
    return prog, np.concatenate([w, s]), theta


@pytest.mark.parametrize("linear", [0.0, 0.5])
@pytest.mark.parametrize("bound_rows", [[], ["simple"]])
@pytest.mark.parametrize("row", [[1.0, 0.0], [1.0, 2.0]])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_slacks_cost_what_was_written(linear: float, bound_rows: list[str], row: list[float], sign: float) -> None:
    prog, w, theta = softened(linear, row, sign)
    solver = DaqpQp(compile_program(prog, w, theta), bound_rows)
    for at in (np.array([value]) for value in (-1.0, 0.1, 4.0)):
        expected, cost = uncompiled(prog, w, theta, at)
        result = solver.solve(at)
        assert result.ok
        np.testing.assert_allclose(result.decisions, expected, atol=1e-5)
        assert result.cost == pytest.approx(cost, abs=1e-8)


def test_a_slack_that_lowers_the_cost_is_an_ordinary_decision() -> None:
    prog, w, theta = softened(-1.0, [1.0, 0.0], 1.0)
    qp = compile_program(prog, w, theta)
    np.testing.assert_allclose(DaqpQp(qp).solve(np.array([0.0])).decisions, [0.0, 0.0, 0.5], atol=1e-9)
    with pytest.raises(InputError, match="3 rows are needed"):
        DaqpQp(qp, ["simple"])


def test_bound_rows_must_be_as_many_as_the_decisions_and_independent() -> None:
    prog = MathematicalProgram()
    w = prog.NewContinuousVariables(2, "w")
    prog.AddQuadraticCost(np.eye(2), np.zeros(2), w)
    for name, rows in (("one", [[1.0, 0.0]]), ("two", [[1.0, 1.0], [2.0, 2.0]])):
        binding = prog.AddLinearConstraint(np.array(rows), np.zeros(len(rows)), np.ones(len(rows)), w)
        binding.evaluator().set_description(name)
    qp = compile_program(prog, w, [])
    with pytest.raises(InputError, match=r"2 rows are needed, one a decision \(given: 1\)"):
        DaqpQp(qp, ["one"])
    with pytest.raises(InputError, match="don't form an invertible matrix"):
        DaqpQp(qp, ["two"])


def test_a_cost_that_is_not_strictly_convex_is_for_clarabel() -> None:
    prog = MathematicalProgram()
    w = prog.NewContinuousVariables(2, "w")
    prog.AddLinearCost(np.ones(2), 0.0, w)
    prog.AddBoundingBoxConstraint(-1.0, 1.0, w)
    qp = compile_program(prog, w, [])
    with pytest.raises(InputError, match="choose clarabel"):
        make_solver("daqp", qp)
    np.testing.assert_allclose(make_solver("clarabel", qp).solve(np.zeros(0)).decisions, -1.0, atol=1e-8)


@pytest.mark.parametrize("solver", [DaqpQp, ClarabelQp])
def test_contradicting_bounds_are_infeasible_and_leave_the_solver_usable(solver: type[DaqpQp | ClarabelQp]) -> None:
    prog = MathematicalProgram()
    w, theta = prog.NewContinuousVariables(2, "w"), prog.NewContinuousVariables(1, "theta")
    prog.AddQuadraticCost(np.eye(2), np.zeros(2), w)
    prog.AddLinearConstraint(np.array([[1.0, 0.0, 1.0]]), [1.0], [np.inf], np.append(w, theta))
    prog.AddBoundingBoxConstraint(-2.0, 2.0, w)
    used = solver(compile_program(prog, w, theta))
    result = used.solve(np.array([-5.0]))
    assert not result.ok
    assert result.infeasible
    np.testing.assert_allclose(used.solve(np.array([0.0])).decisions, [1.0, 0.0], atol=1e-6)


def test_there_are_two_solvers() -> None:
    qp = compile_program(*random_program(0))
    assert isinstance(make_solver("daqp", qp), DaqpQp)
    assert isinstance(make_solver("clarabel", qp), ClarabelQp)
    with pytest.raises(InputError, match="solver 'osqp': choose daqp or clarabel"):
        make_solver("osqp", qp)


def test_clarabel_stands_in_where_daqp_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pdhocbf_drake.qp.solvers.has_daqp", lambda: False)
    qp = compile_program(*random_program(7))
    solver = make_solver("daqp", qp)
    assert isinstance(solver, ClarabelQp)
    np.testing.assert_allclose(solver.solve(np.zeros(4)).decisions, DaqpQp(qp).solve(np.zeros(4)).decisions, atol=1e-5)
