"""Rows of a program equal the recursion, for affine and for nonlinear dynamics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.solvers import MathematicalProgram, SnoptSolver, Solve

from pdhocbf_drake.barriers import (
    AffineBarrier,
    Barrier,
    PeriodicAffineSystem,
    Saturating,
    add_barrier_rows,
    add_dynamics,
    add_nonlinear_barrier_rows,
    affine_rows,
    constant,
    harmonic,
    psi,
    record,
    rollout,
    tabulated,
)
from pdhocbf_drake.errors import InputError


def random_case(seed, n=3, inputs=2, order=2, sign=1, degree=None):
    """A periodic system and a barrier of that relative degree (m if None), whose normal varies with the phase."""
    rng = np.random.default_rng(seed)
    A, B, c = rng.normal(size=(3, n, n)), rng.normal(size=(3, n, inputs)), rng.normal(size=(3, n))
    for i in range((degree or order) - 1):  # state i is reached through state i + 1 only
        B[:, i], A[:, i, i + 2 :] = 0.0, 0.0
    T, _ = np.linalg.qr(rng.normal(size=(n, n)))
    normals = rng.uniform(0.5, 1.5, (2, 1)) * T[:, 0]
    barrier = AffineBarrier("b", normals, tabulated(rng.normal(size=4)), sign, rng.uniform(0.1, 1, order), "m/s")
    return rng, PeriodicAffineSystem(T @ A @ T.T, T @ B, c), barrier


def last_psis(barrier, system, k, x, inputs):
    """ψ_m(k), …, ψ_m(k+H−m) by simulating and recursing from every tick anew."""
    states = rollout(system, k, x, inputs)
    count = len(inputs) - barrier.order + 1
    return [psi(barrier, system, k + i, states[i], inputs[i : i + barrier.order])[-1] for i in range(count)]


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 3), st.sampled_from([1, -1]), st.integers(0, 25),
    st.integers(3, 6),
)  # fmt: skip
def test_affine_rows_equal_the_recursion(seed, order, degree, sign, k, horizon):
    rng, system, barrier = random_case(seed, order=order, sign=sign, degree=degree)
    x, inputs = rng.normal(size=3), rng.normal(size=(horizon, 2))
    rows = affine_rows(barrier, system, k, horizon)
    found = rows.values(x, inputs, barrier.bound.samples(k, horizon + 1))
    expected = last_psis(barrier, system, k, x, inputs)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * (1 + np.abs(expected).max()))
    # depends on k only through its phase
    again = affine_rows(barrier, system, k + 12, horizon)
    assert all(np.array_equal(a, b) for a, b in zip(rows, again, strict=True))


@pytest.mark.parametrize("x_free", [False, True])
@pytest.mark.parametrize("slacks", [0, 1, 4])
def test_program_rows_equal_the_recursion(x_free, slacks):
    rng, system, barrier = random_case(5)
    k, horizon, tightening = 7, 5, 0.3
    x, inputs, slack = rng.normal(size=3), rng.normal(size=(horizon, 2)), rng.uniform(size=slacks)
    prog = MathematicalProgram()
    x_var, u_var = prog.NewContinuousVariables(3, "x"), prog.NewContinuousVariables(horizon, 2, "u")
    s_var = prog.NewContinuousVariables(slacks, "s")
    binding = add_barrier_rows(
        prog, barrier, system, k, x_var if x_free else x, u_var, s_var if slacks else None, tightening
    )
    prog.SetInitialGuess(x_var, x)
    prog.SetInitialGuess(u_var, inputs)
    prog.SetInitialGuess(s_var, slack)
    over = prog.EvalBindingAtInitialGuess(binding) - binding.evaluator().lower_bound()
    expected = np.array(last_psis(barrier, system, k, x, inputs)) + (slack if slacks else 0.0) - tightening
    assert over == pytest.approx(expected, abs=1e-9 * (1 + np.abs(expected).max()))
    assert binding.evaluator().get_description() == "barrier b"
    names = [c.evaluator().get_description() for c in prog.bounding_box_constraints()]
    assert names == (["barrier b: slack"] if slacks else [])


def vhip(phases=4):
    eta = 17.0 + np.cos(2 * np.pi * np.arange(phases) / phases)
    A = np.array([[[1, 0.01, 0], [e * 0.01, 1, -e * 0.01], [0, 0, 1]] for e in eta])
    return PeriodicAffineSystem(A, [[0.0], [0.0], [0.01]])


def test_rows_that_no_input_reaches_are_left_out():
    """ψ_1 of the VHIP's velocity: the first row is a fact about x(k), even a false one."""
    barrier = AffineBarrier("vx", [0.0, 1.0, 0.0], constant(0.5), 1, (0.5,), "m/s", relative_degree=2)
    rows = affine_rows(barrier, vhip(), 0, 6)
    assert rows.reachable.tolist() == [False] + [True] * 5
    prog = MathematicalProgram()
    u = prog.NewContinuousVariables(6, 1, "u")
    binding = add_barrier_rows(prog, barrier, vhip(), 0, [1.0, 0.49, 0.0], u)
    assert binding.evaluator().num_constraints() == 5
    assert Solve(prog).is_success()


@pytest.mark.parametrize("seed", range(3))
def test_rows_that_no_input_reaches_are_left_out_in_any_coordinates(seed):
    """Rounding gives an input that does not show in a row of ψ_1 a coefficient of 1e-17, which is no way to keep it."""
    _, system, usual = random_case(seed, order=1, degree=2)
    barrier = AffineBarrier("b", usual.normal, usual.bound, 1, usual.class_k, "m", relative_degree=2)
    prog = MathematicalProgram()
    u = prog.NewContinuousVariables(6, 2, "u")
    outside = barrier.normals(0, 1)[0] * (barrier.bound(0) + 100.0)
    binding = add_barrier_rows(prog, barrier, system, 0, outside, u)
    result = Solve(prog)
    assert result.is_success()
    assert np.abs(result.GetSolution(u)).max() < 1e6
    inputs_of_row = np.abs(binding.evaluator().GetDenseA()).reshape(5, 6, 2).max(axis=2)
    np.testing.assert_array_equal(inputs_of_row > 0, np.tri(5, 6, dtype=bool))  # u(k), …, u(k+i−1) in ψ_1(k+i)


def test_a_horizon_of_psi_rows_keeps_h_nonnegative():
    """The plan of least effort under the rows, from a state that would break the bound without them."""
    barrier = AffineBarrier("vx", [0.0, 1.0, 0.0], harmonic(0.5, 0.05, 0.0, 4), 1, (0.5, 0.5), "m/s")
    x, system = np.array([0.02, 0.4, 0.0]), vhip()
    least = {}
    for rows in (True, False):
        prog = MathematicalProgram()
        u = prog.NewContinuousVariables(40, 1, "u")
        prog.AddQuadraticErrorCost(np.eye(40), np.zeros(40), u.ravel())
        if rows:
            add_barrier_rows(prog, barrier, system, 0, x, u)
        result = Solve(prog)
        assert result.is_success()
        least[rows] = record(barrier, rollout(system, 0, x, result.GetSolution(u))).h_min
    assert least[True] > -1e-6
    assert least[False] < -0.05


class Pendulum:
    """θ⁺ = θ + δω, ω⁺ = ω + δ(a_k sin θ + u), hanging from a point that is accelerated with period 2."""

    period, n, m = 2, 2, 1

    def step(self, k, x, u):
        pull = -10.0 if k % 2 else -8.0
        return np.array([x[0] + 0.05 * x[1], x[1] + 0.05 * (pull * np.sin(x[0]) + u[0])])


ANGLE = Barrier("angle", lambda k, x: 1.0 + 0.1 * (k % 3 == 1) - x[0] ** 2, 3, (Saturating(0.5, 0.3), 0.4))


@pytest.mark.parametrize("shooting", [True, False])
@pytest.mark.parametrize("slacks", [0, 1, 4])
def test_nonlinear_rows_equal_the_recursion(shooting, slacks):
    rng = np.random.default_rng(2)
    k, horizon, tightening = 4, 5, 0.2
    x, inputs, slack = rng.normal(size=2), rng.normal(size=(horizon, 1)), rng.uniform(size=slacks)
    states = rollout(Pendulum(), k, x, inputs)
    prog = MathematicalProgram()
    x_var, u_var = prog.NewContinuousVariables(horizon + 1, 2, "x"), prog.NewContinuousVariables(horizon, 1, "u")
    s_var = prog.NewContinuousVariables(slacks, "s")
    for start in (x, x_var[0]) if shooting else (x_var,):
        bindings = add_nonlinear_barrier_rows(
            prog, ANGLE, Pendulum(), k, start, u_var, s_var if slacks else None, tightening
        )
        prog.SetInitialGuess(x_var, states)
        prog.SetInitialGuess(u_var, inputs)
        prog.SetInitialGuess(s_var, slack)
        over = np.concatenate([prog.EvalBindingAtInitialGuess(one) - one.evaluator().lower_bound() for one in bindings])
        expected = np.array(last_psis(ANGLE, Pendulum(), k, x, inputs)) + (slack if slacks else 0.0) - tightening
        assert over == pytest.approx(expected, abs=1e-12)
        assert all(one.evaluator().get_description().startswith("barrier angle") for one in bindings)


def test_dynamics_constraints_vanish_on_a_trajectory_only():
    rng = np.random.default_rng(3)
    inputs = rng.normal(size=(4, 1))
    states = rollout(Pendulum(), 1, rng.normal(size=2), inputs)
    prog = MathematicalProgram()
    x_var, u_var = prog.NewContinuousVariables(5, 2, "x"), prog.NewContinuousVariables(4, 1, "u")
    bindings = add_dynamics(prog, Pendulum(), 1, x_var, u_var)
    prog.SetInitialGuess(x_var, states)
    prog.SetInitialGuess(u_var, inputs)
    assert prog.CheckSatisfiedAtInitialGuess(bindings, 1e-12)
    prog.SetInitialGuess(u_var, inputs + 0.1)
    assert not prog.CheckSatisfiedAtInitialGuess(bindings, 1e-3)


@pytest.mark.parametrize("shooting", [True, False])
def test_pendulum_program_keeps_its_barrier(shooting):
    """Least effort from θ = 0.9 rad, ω = 1.5 rad/s: without the rows the angle passes 1 rad."""
    x, horizon = np.array([0.9, 1.5]), 12
    free = rollout(Pendulum(), 0, x, np.zeros((horizon, 1)))
    assert record(ANGLE, free).h_min < -0.05
    prog = MathematicalProgram()
    u = prog.NewContinuousVariables(horizon, 1, "u")
    prog.AddQuadraticErrorCost(np.eye(horizon), np.zeros(horizon), u.ravel())
    if shooting:
        add_nonlinear_barrier_rows(prog, ANGLE, Pendulum(), 0, x, u)
    else:
        states = prog.NewContinuousVariables(horizon + 1, 2, "x")
        prog.AddBoundingBoxConstraint(x, x, states[0])
        add_dynamics(prog, Pendulum(), 0, states, u)
        add_nonlinear_barrier_rows(prog, ANGLE, Pendulum(), 0, states, u)
        prog.SetInitialGuess(states, free)
    prog.SetInitialGuess(u, np.zeros((horizon, 1)))
    result = SnoptSolver().Solve(prog, prog.initial_guess(), None)
    assert result.is_success()
    assert record(ANGLE, rollout(Pendulum(), 0, x, result.GetSolution(u))).h_min > -1e-6


@pytest.mark.parametrize("shooting", [True, False])
def test_nonlinear_rows_start_where_an_input_reaches(shooting):
    """ψ_1 of an angle, relative degree 2: its first row is a fact about x(k)."""
    late = Barrier("late", lambda k, x: 1.0 - x[0] ** 2, 1, (0.5,), relative_degree=2)
    x, inputs = np.array([0.9, 1.5]), np.ones((4, 1))
    expected = last_psis(late, Pendulum(), 0, x, inputs)
    prog = MathematicalProgram()
    x_var, u_var = prog.NewContinuousVariables(5, 2, "x"), prog.NewContinuousVariables(4, 1, "u")
    bindings = add_nonlinear_barrier_rows(prog, late, Pendulum(), 0, x if shooting else x_var, u_var)
    prog.SetInitialGuess(x_var, rollout(Pendulum(), 0, x, inputs))
    prog.SetInitialGuess(u_var, inputs)
    found = np.concatenate([prog.EvalBindingAtInitialGuess(one) for one in bindings])
    assert expected[0] < 0
    assert found == pytest.approx(expected[1:], abs=1e-12)


def test_linear_dynamics_give_the_same_rows_either_way():
    rng, system, barrier = random_case(11, inputs=1)
    x, inputs = rng.normal(size=3), rng.normal(size=(4, 1))
    prog = MathematicalProgram()
    u = prog.NewContinuousVariables(4, 1, "u")
    prog.SetInitialGuess(u, inputs)
    affine = add_barrier_rows(prog, barrier, system, 2, x, u)
    (nonlinear,) = add_nonlinear_barrier_rows(prog, barrier, system, 2, x, u)
    left, right = (prog.EvalBindingAtInitialGuess(b) - b.evaluator().lower_bound() for b in (affine, nonlinear))
    assert left == pytest.approx(right, abs=1e-9 * (1 + np.abs(right).max()))


def wrong_rows(horizon=5, x=(0.0, 0.0, 0.0), slacks=None, columns=2, barrier=None, nonlinear=False):
    _, system, usual = random_case(0)
    prog = MathematicalProgram()
    u = prog.NewContinuousVariables(horizon, columns, "u")
    s = None if slacks is None else prog.NewContinuousVariables(slacks, "s")
    add = add_nonlinear_barrier_rows if nonlinear else add_barrier_rows
    with pytest.raises(InputError) as caught:
        add(prog, barrier or usual, system, 0, np.array(x), u, s)
    return str(caught.value)


def test_wrong_rows_are_refused_in_one_sentence():
    saturating = AffineBarrier("b", [1.0, 0.0, 0.0], constant(1), 1, (0.5, Saturating(0.5, 0.1)))
    short = AffineBarrier("b", [1.0, 0.0], constant(1), 1, (0.5, 0.5))
    assert wrong_rows(1) == 'barrier "b": psi_2 needs a horizon of 2 ticks, given 1'
    assert wrong_rows(1, nonlinear=True) == 'barrier "b": a horizon of 2 ticks is needed, given 1'
    assert wrong_rows(x=(0.0, 0.0)) == 'barrier "b": x0 must have shape (3,), given (2,)'
    assert wrong_rows(x=(0.0, 0.0), nonlinear=True) == (
        'barrier "b": the states must have shape (3,) or (6, 3), given (2,)'
    )
    assert wrong_rows(columns=1) == 'barrier "b": the inputs must have shape (H, 2), given (5, 1)'
    assert wrong_rows(columns=1, nonlinear=True) == wrong_rows(columns=1)
    assert wrong_rows(slacks=3) == 'barrier "b": 1 slack, or one per row (4), is allowed, given 3'
    assert wrong_rows(slacks=3, nonlinear=True) == wrong_rows(slacks=3)
    assert wrong_rows(barrier=short) == 'barrier "b": the normal has 2 entries, but the system 3 states'
    assert wrong_rows(barrier=saturating) == (
        'barrier "b": class-K function 2 is Saturating(gamma=0.5, scale=0.1), but affine rows need linear ones; '
        "add_nonlinear_barrier_rows takes any"
    )


def test_systems_are_checked():
    for build, text in (
        (lambda: PeriodicAffineSystem(np.ones((2, 3)), np.ones((2, 1))),
         "A must have shape (period, n, n) or (n, n), given (2, 3)"),
        (lambda: PeriodicAffineSystem(np.eye(2), np.ones((3, 1))),
         "B must have shape (period, 2, m) or (2, m), given (3, 1)"),
        (lambda: PeriodicAffineSystem(np.eye(2), np.ones((2, 1)), np.ones(3)),
         "c must have shape (period, 2) or (2,), given (1, 3)"),
        (lambda: PeriodicAffineSystem(np.ones((4, 2, 2)), np.ones((3, 2, 1))),
         "A, B and c share one period, or are constant: B has 3, not 4"),
        (lambda: PeriodicAffineSystem(np.eye(2) * np.nan, np.ones((2, 1))), "A must be finite, given nan in it"),
    ):  # fmt: skip
        with pytest.raises(InputError) as caught:
            build()
        assert str(caught.value) == text


def test_drake_systems_become_periodic_ones():
    from pydrake.systems.primitives import AffineSystem, LinearSystem

    rng = np.random.default_rng(0)
    A, B, f0 = rng.normal(size=(2, 2)), rng.normal(size=(2, 1)), rng.normal(size=2)
    x, u = rng.normal(size=2), rng.normal(size=1)
    affine = PeriodicAffineSystem.from_drake(AffineSystem(A, B, f0, np.eye(2), np.zeros((2, 1)), np.zeros(2), 0.1))
    assert affine.step(3, x, u) == pytest.approx(A @ x + B @ u + f0)
    linear = PeriodicAffineSystem.from_drake(LinearSystem(A, B, np.eye(2), np.zeros((2, 1)), 0.1))
    assert linear.step(3, x, u) == pytest.approx(A @ x + B @ u)
    with pytest.raises(InputError) as caught:
        PeriodicAffineSystem.from_drake(LinearSystem(A, B, np.eye(2), np.zeros((2, 1))))
    assert str(caught.value) == "the system has continuous time (time_period 0): discretise it first"
