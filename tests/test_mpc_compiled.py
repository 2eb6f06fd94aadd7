"""A compiled program is the program: the same optimum, wherever it was read from and however it is started."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.solvers import ClarabelSolver, MathematicalProgram, SolverOptions

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp import AffineMap, ClarabelQp, DaqpQp, QuadraticForm, compile_program, make_solver
from pdhocbf_drake.studies.bench.reference import reference


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
    prog.AddBoundingBoxConstraint(-1.0, 1.0, w)
    if slacks:
        slack = prog.NewContinuousVariables(2, "slack")
        softened = np.hstack([random.normal(size=(2, 6)), np.eye(2)])
        prog.AddLinearConstraint(softened, np.full(2, 1.5), np.full(2, np.inf), np.concatenate([w, slack]))
        prog.AddBoundingBoxConstraint(0.0, np.inf, slack)
        prog.AddQuadraticCost(4.0 * np.eye(2), np.full(2, 0.5), slack)
        w = np.concatenate([w, slack])
    return prog, w, theta


def uncompiled(prog: MathematicalProgram, w: np.ndarray, theta: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, float]:
    """Drake's answer to the program as it was written, with its parameters held."""
    copy = prog.Clone()
    copy.AddBoundingBoxConstraint(at, at, theta)
    options = SolverOptions()
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        options.SetOption(ClarabelSolver.id(), name, 1e-11)
    result = ClarabelSolver().Solve(copy, None, options)
    assert result.is_success()
    return result.GetSolution(w), result.get_optimal_cost()


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), slacks=st.booleans())
def test_compiled_and_uncompiled_agree_on_random_programs(seed: int, slacks: bool) -> None:
    prog, w, theta = random_program(seed, slacks)
    at = 0.1 * np.random.default_rng(seed).normal(size=4)
    expected, cost = uncompiled(prog, w, theta, at)
    qp = compile_program(prog, w, theta)
    for solver in (DaqpQp(qp), ClarabelQp(qp)):
        result = solver.solve(at)
        assert result.ok, result.status
        np.testing.assert_allclose(result.decisions, expected, atol=2e-5)
        assert result.cost == pytest.approx(cost, abs=1e-6)
    exact, certain = reference(qp, at, expected)
    assert certain
    np.testing.assert_allclose(DaqpQp(qp).solve(at).decisions, exact, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), guess=st.lists(st.sampled_from([-1.0, 0.0, 1.0]), min_size=20, max_size=20))
def test_the_warm_start_never_changes_the_answer(seed: int, guess: list[float]) -> None:
    prog, w, theta = random_program(seed, slacks=True)
    at = 0.1 * np.random.default_rng(seed).normal(size=4)
    qp = compile_program(prog, w, theta)
    flags = np.resize(np.array(guess), len(qp.A))
    cold, warm = DaqpQp(qp).solve(at), DaqpQp(qp).solve(at, flags)
    assert warm.ok == cold.ok
    np.testing.assert_allclose(warm.decisions, cold.decisions, atol=1e-9)
    assert warm.cost == pytest.approx(cold.cost, abs=1e-9)


def test_what_was_solved_before_never_changes_the_answer() -> None:
    prog, w, theta = random_program(3)
    qp = compile_program(prog, w, theta)
    used = DaqpQp(qp)
    random = np.random.default_rng(0)
    last = None
    for _ in range(30):
        at = 0.2 * random.normal(size=4)
        result, fresh = used.solve(at, last), DaqpQp(qp).solve(at)
        assert result.ok == fresh.ok
        if result.ok:
            np.testing.assert_allclose(result.decisions, fresh.decisions, atol=1e-9)
        last = result.active


@pytest.mark.parametrize("seed", range(5))
def test_maps_and_forms_are_those_of_their_matrices(seed: int) -> None:
    random = np.random.default_rng(seed)
    matrix = random.normal(size=(30, 12)) * (random.random((30, 12)) < [0.05, 0.9][seed % 2])
    offset, theta = random.normal(size=30), random.normal(size=12)
    assert np.allclose(AffineMap(offset, matrix)(theta), offset + matrix @ theta, atol=1e-13)
    assert np.array_equal(AffineMap(offset, matrix).matrix, matrix)
    square, vector = matrix[:12].T @ matrix[:12], random.normal(size=12)
    form = QuadraticForm(square, vector, 2.0)
    assert form(theta) == pytest.approx(0.5 * theta @ square @ theta + vector @ theta + 2.0)
    chosen = random.permutation(30)[:7]
    some = AffineMap(offset, matrix).rows(chosen)
    both = some.above(AffineMap(offset, matrix))
    assert np.array_equal(some.matrix, matrix[chosen]) and np.array_equal(some.offset, offset[chosen])
    assert np.array_equal(both.matrix, np.vstack([matrix[chosen], matrix]))
    assert np.allclose(both(theta), np.concatenate([some(theta), offset + matrix @ theta]), atol=1e-13)
    assert np.array_equal(both.changing, matrix[[*chosen, *range(30)]].any(axis=1))


def test_parameters_and_guesses_of_another_length_are_refused_before_machine_code_reads_them() -> None:
    prog, w, theta = random_program(0)
    qp = compile_program(prog, w, theta)
    solver, at = DaqpQp(qp), np.zeros(len(theta))
    for asked in (
        lambda: solver.solve(at[1:]),
        lambda: solver.solve(at, np.zeros(len(qp.A) - 1)),
        lambda: qp.constant(at[1:]),
        lambda: qp.linear(at[1:]),
    ):
        with pytest.raises(ValueError, match="θ"):
            asked()


def test_rows_that_say_the_same_are_merged() -> None:
    prog, w, theta = random_program(0)
    qp = compile_program(prog, w, theta)
    # 5 one-sided rows, 2 of them negated again with two bounds (of which one finds its row free), 1 equality, 6 bounds
    assert len(qp.A) == 5 + 2 + 1 + 6
    random = np.random.default_rng(1)
    at = 0.1 * random.normal(size=4)
    point = uncompiled(prog, w, theta, at)[0]
    _, low, high = qp.vectors(at)
    assert np.all(qp.A @ point >= low - 1e-8) and np.all(qp.A @ point <= high + 1e-8)


def test_a_variable_that_appears_twice_in_a_binding_counts_twice() -> None:
    prog = MathematicalProgram()
    w = prog.NewContinuousVariables(2, "w")
    prog.AddQuadraticCost(np.eye(2), np.zeros(2), w)
    prog.AddLinearConstraint(np.array([[1.0, 1.0, 1.0]]), [3.0], [np.inf], np.array([w[0], w[0], w[1]]))
    np.testing.assert_allclose(DaqpQp(compile_program(prog, w, [])).solve(np.zeros(0)).decisions, [1.2, 0.6], atol=1e-9)


def _lorentz(prog: MathematicalProgram, w: np.ndarray) -> None:
    prog.AddLorentzConeConstraint(np.eye(2), np.zeros(2), w).evaluator().set_description("cone")


def _stranger(prog: MathematicalProgram, w: np.ndarray) -> None:
    other = prog.NewContinuousVariables(1, "other")
    prog.AddLinearConstraint(np.ones((1, 2)), [0.0], [1.0], [w[0], other[0]]).evaluator().set_description("stranger")


def _quartic(prog: MathematicalProgram, w: np.ndarray) -> None:
    prog.AddCost(w[0] ** 4).evaluator().set_description("quartic")


def _concave(prog: MathematicalProgram, w: np.ndarray) -> None:
    prog.AddQuadraticCost(-3.0 * np.eye(2), np.zeros(2), w, is_convex=False).evaluator().set_description("concave")


def _flattered(prog: MathematicalProgram, w: np.ndarray) -> None:
    prog.AddQuadraticCost(-3.0 * np.eye(2), np.zeros(2), w, is_convex=True).evaluator().set_description("flattered")


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (_flattered, "cost flattered: it is not convex in the decisions, so it can't be compiled"),
        (_lorentz, "constraint cone: only linear constraints can be compiled"),
        (_stranger, "stranger: uses a variable that is neither a decision nor a parameter"),
        (_quartic, "cost quartic: only linear and quadratic costs can be compiled"),
        (_concave, "cost concave: it is not convex in the decisions, so it can't be compiled"),
    ],
)
def test_a_program_of_another_form_is_refused_by_the_name_of_its_binding(spoil, sentence: str) -> None:  # type: ignore[no-untyped-def]
    prog = MathematicalProgram()
    w = prog.NewContinuousVariables(2, "w")
    prog.AddQuadraticCost(np.eye(2), np.zeros(2), w)
    spoil(prog, w)
    with pytest.raises(InputError) as error:
        compile_program(prog, w, [])
    assert str(error.value) == sentence


def test_an_integer_decision_is_refused() -> None:
    prog = MathematicalProgram()
    w = prog.NewBinaryVariables(1, "yes")
    with pytest.raises(InputError, match="only continuous variables"):
        compile_program(prog, w, [])


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


def test_contradicting_bounds_are_infeasible_in_both_solvers_and_leave_them_usable() -> None:
    prog = MathematicalProgram()
    w, theta = prog.NewContinuousVariables(2, "w"), prog.NewContinuousVariables(1, "theta")
    prog.AddQuadraticCost(np.eye(2), np.zeros(2), w)
    prog.AddLinearConstraint(np.array([[1.0, 0.0, 1.0]]), [1.0], [np.inf], np.append(w, theta))
    prog.AddBoundingBoxConstraint(-2.0, 2.0, w)
    qp = compile_program(prog, w, theta)
    for solver in (DaqpQp(qp), ClarabelQp(qp)):
        result = solver.solve(np.array([-5.0]))
        assert not result.ok and result.infeasible
        assert np.allclose(solver.solve(np.array([0.0])).decisions, [1.0, 0.0], atol=1e-6)


def test_without_daqp_everything_goes_through_drake(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pdhocbf_drake.qp.solvers.has_daqp", lambda: False)
    prog, w, theta = random_program(7)
    qp = compile_program(prog, w, theta)
    solver = make_solver("daqp", qp)
    assert isinstance(solver, ClarabelQp)
    np.testing.assert_allclose(solver.solve(np.zeros(4)).decisions, DaqpQp(qp).solve(np.zeros(4)).decisions, atol=1e-5)
