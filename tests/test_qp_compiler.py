"""What `compile_program` reads out of a program, and what it refuses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from pydrake.solvers import MathematicalProgram
from qp_programs import random_program, uncompiled

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp import AffineMap, QuadraticForm, compile_program


@pytest.fixture
def matrix(request: pytest.FixtureRequest) -> np.ndarray:
    random = np.random.default_rng(0)
    return random.normal(size=(30, 12)) * (random.random((30, 12)) < request.param)


SPARSE_AND_DENSE = pytest.mark.parametrize("matrix", [0.05, 0.9], indirect=True)


@SPARSE_AND_DENSE
def test_an_affine_map_is_that_of_its_matrix(matrix: np.ndarray) -> None:
    random = np.random.default_rng(1)
    offset, theta = random.normal(size=30), random.normal(size=12)
    made = AffineMap(offset, matrix)
    np.testing.assert_allclose(made(theta), offset + matrix @ theta, atol=1e-13)
    np.testing.assert_array_equal(made.matrix, matrix)
    np.testing.assert_array_equal(made.changing, matrix.any(axis=1))


@SPARSE_AND_DENSE
def test_rows_of_an_affine_map_are_chosen_and_stacked(matrix: np.ndarray) -> None:
    random = np.random.default_rng(2)
    offset, theta, chosen = random.normal(size=30), random.normal(size=12), random.permutation(30)[:7]
    whole = AffineMap(offset, matrix)
    some = whole.rows(chosen)
    np.testing.assert_array_equal(some.matrix, matrix[chosen])
    np.testing.assert_array_equal(some.offset, offset[chosen])
    both = some.stacked(whole)
    np.testing.assert_array_equal(both.matrix, np.vstack([matrix[chosen], matrix]))
    np.testing.assert_array_equal(both.changing, matrix[[*chosen, *range(30)]].any(axis=1))
    np.testing.assert_allclose(both(theta), np.concatenate([some(theta), offset + matrix @ theta]), atol=1e-13)


@SPARSE_AND_DENSE
def test_a_quadratic_form_is_that_of_its_matrix(matrix: np.ndarray) -> None:
    random = np.random.default_rng(3)
    square, vector, theta = matrix[:12].T @ matrix[:12], random.normal(size=12), random.normal(size=12)
    form = QuadraticForm(square, vector, 2.0)
    assert form(theta) == pytest.approx(0.5 * theta @ square @ theta + vector @ theta + 2.0)


def test_rows_with_equal_or_opposite_coefficients_are_merged() -> None:
    prog, w, theta = random_program(0)
    qp = compile_program(prog, w, theta)
    # 5 rows with a lower bound, 2 opposite ones with two bounds, of which one is free in each, 1 equality, 6 bounds
    assert len(qp.A) == 5 + 2 + 1 + 6
    at = 0.1 * np.random.default_rng(1).normal(size=4)
    rows = qp.A @ uncompiled(prog, w, theta, at)[0]
    _, low, high = qp.vectors(at)
    assert np.all(rows >= low - 1e-8)
    assert np.all(rows <= high + 1e-8)


def test_a_merged_row_has_both_bounds_and_the_first_name() -> None:
    prog = MathematicalProgram()
    w, theta = prog.NewContinuousVariables(2, "w"), prog.NewContinuousVariables(1, "theta")
    below, above = np.array([[1.0, 2.0, -1.0]]), np.array([[-1.0, -2.0, -1.0]])
    for name, row in (("below", below), ("above", above)):  # θ ≤ w_0 + 2 w_1, and w_0 + 2 w_1 ≤ 3 − θ
        bound = prog.AddLinearConstraint(row, [0.0 if name == "below" else -3.0], [np.inf], np.append(w, theta))
        bound.evaluator().set_description(name)
    qp = compile_program(prog, w, theta)
    np.testing.assert_array_equal(qp.A, [[1.0, 2.0]])
    assert qp.names == ("below",)
    np.testing.assert_array_equal(qp.vectors(np.array([0.5]))[1:], [[0.5], [2.5]])


def test_two_lower_bounds_on_equal_coefficients_stay_two_rows() -> None:
    prog = MathematicalProgram()
    w = prog.NewContinuousVariables(1, "w")
    for lower in (1.0, 2.0):
        prog.AddLinearConstraint(np.ones((1, 1)), [lower], [np.inf], w)
    assert len(compile_program(prog, w, []).A) == 2


def test_a_variable_that_appears_twice_in_a_binding_counts_twice() -> None:
    prog = MathematicalProgram()
    w = prog.NewContinuousVariables(2, "w")
    prog.AddQuadraticCost(np.ones((3, 3)), np.zeros(3), np.array([w[0], w[0], w[1]]))
    prog.AddLinearConstraint(np.array([[1.0, 1.0, 1.0]]), [3.0], [np.inf], np.array([w[0], w[0], w[1]]))
    qp = compile_program(prog, w, [])
    np.testing.assert_array_equal(qp.A, [[2.0, 1.0]])
    np.testing.assert_array_equal(qp.P, [[4.0, 2.0], [2.0, 1.0]])


def test_parameters_of_another_length_are_refused_before_machine_code_reads_them() -> None:
    qp = compile_program(*random_program(0))
    for function in (qp.constant, qp.linear, qp.vectors):
        with pytest.raises(InputError, match=r"θ must have shape \(4,\), given \(3,\)"):
            function(np.zeros(3))


def _lorentz(prog: MathematicalProgram, w: np.ndarray) -> None:
    prog.AddLorentzConeConstraint(np.eye(2), np.zeros(2), w).evaluator().set_description("cone")


def _stranger(prog: MathematicalProgram, w: np.ndarray) -> None:
    other = prog.NewContinuousVariables(1, "other")
    prog.AddLinearConstraint(np.ones((1, 2)), [0.0], [1.0], [w[0], other[0]]).evaluator().set_description("stranger")


def _quartic(prog: MathematicalProgram, w: np.ndarray) -> None:
    prog.AddCost(w[0] ** 4).evaluator().set_description("quartic")


def _concave(prog: MathematicalProgram, w: np.ndarray) -> None:
    prog.AddQuadraticCost(-3.0 * np.eye(2), np.zeros(2), w, is_convex=False).evaluator().set_description("concave")


def _said_convex(prog: MathematicalProgram, w: np.ndarray) -> None:
    prog.AddQuadraticCost(-3.0 * np.eye(2), np.zeros(2), w, is_convex=True).evaluator().set_description("said convex")


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (_said_convex, "cost said convex: it is not convex in the decisions, so it can't be compiled"),
        (_lorentz, "constraint cone: only linear constraints can be compiled"),
        (_stranger, "stranger: uses a variable that is neither a decision nor a parameter"),
        (_quartic, "cost quartic: only linear and quadratic costs can be compiled"),
        (_concave, "cost concave: it is not convex in the decisions, so it can't be compiled"),
    ],
)
def test_a_program_of_another_form_is_refused_by_the_name_of_its_binding(
    spoil: Callable[[MathematicalProgram, np.ndarray], None], sentence: str
) -> None:
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
