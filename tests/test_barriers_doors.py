"""The same checks at every function that takes a barrier or a system, and no raw errors of what users write."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydrake.solvers import MathematicalProgram

from pdhocbf_drake.barriers import (
    AffineBarrier,
    Barrier,
    BarrierFilter,
    NonlinearFilter,
    PeriodicAffineSystem,
    Saturating,
    add_nonlinear_barrier_rows,
    check_in_safe_set,
    check_relative_degree,
    constant,
    enforced_psi,
    feasible_width,
    in_safe_set,
    initial_psi,
    input_interval,
    psi,
    record,
    record_from_h,
    rollout,
    tabulated,
)
from pdhocbf_drake.errors import InputError

TICK = 0.1
CART = PeriodicAffineSystem([[1.0, TICK], [0.0, 1.0]], [[0.0], [TICK]])
LINE = PeriodicAffineSystem([[1.0]], [[TICK]])
X = np.array([0.9, 0.3])


class Own:
    """A system of a user's own, of two states and one input."""

    period, n, m = 1, 2, 1

    def __init__(self, step, **parts):
        self._step = step
        vars(self).update(parts)

    def step(self, k, x, u):
        return self._step(x, u)


def cart(x, u):
    return np.array([x[0] + TICK * x[1], x[1] + TICK * u[0]])


def position(order=2):
    return Barrier("p", lambda k, x: 1.0 - x[0], 1, [0.5] * order)


def message(call):
    with pytest.raises(InputError) as caught:
        call()
    return str(caught.value)


def rows(barrier, system):
    prog = MathematicalProgram()
    return add_nonlinear_barrier_rows(prog, barrier, system, 0, X, prog.NewContinuousVariables(5, 1, "u"))


DOORS = {
    "BarrierFilter": lambda b, s: BarrierFilter(s, [b]),
    "NonlinearFilter": lambda b, s: NonlinearFilter(s, [b]),
    "check_relative_degree": lambda b, s: check_relative_degree(b, s),
    "check_in_safe_set": lambda b, s: check_in_safe_set(b, s, 0, X),
    "in_safe_set": lambda b, s: in_safe_set(b, s, 0, X),
    "initial_psi": lambda b, s: initial_psi(b, s, 0, X),
    "input_interval": lambda b, s: input_interval(s, [b], 0, X),
    "enforced_psi": lambda b, s: enforced_psi(b, s, 0, X, [0.0]),
    "add_nonlinear_barrier_rows": rows,
}
TAKES_A_SYSTEM = DOORS | {
    "psi": lambda b, s: psi(b, s, 0, X, [[0.0]]),
    "rollout": lambda b, s: rollout(s, 0, X, [[0.0]]),
}


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize("system", [CART, Own(cart)], ids=["affine", "own"])
@pytest.mark.parametrize("affine", [True, False])
def test_a_wrong_relative_degree_is_refused_everywhere(door, system, affine):
    wrong = AffineBarrier("p", [1.0, 0.0], constant(1.0), 1, [0.3]) if affine else position(1)
    text = 'barrier "p": relative degree 1 is declared by 1 class-K function, but the dynamics give 2 (at every phase)'
    assert message(lambda: DOORS[door](wrong, system)) == text
    DOORS[door](AffineBarrier("p", [1.0, 0.0], constant(1.0), 1, [0.5, 0.5]) if affine else position(), system)


def test_a_wrong_relative_degree_has_no_feasible_width():
    wrong = AffineBarrier("p", [1.0, 0.0], constant(1.0), 1, [0.3])
    assert "the dynamics give 2" in message(lambda: feasible_width(CART, [wrong], 0))


def test_an_interval_of_inputs_needs_psi_affine_in_the_input():
    """x⁺ = x + 0.1 u, h = 1 − x², γ = 1: ψ_1 ≥ 0 at x = 0.5 for u in [−15, 5], which no one gradient shows."""
    square = Barrier("q", lambda k, x: 1.0 - x[0] ** 2, 1, [1.0])
    assert message(lambda: input_interval(LINE, [square], 0, [0.5])) == (
        'barrier "q": psi_1 is not affine in the input, which input_interval needs; NonlinearFilter takes any'
    )
    keep = NonlinearFilter(LINE, [square])
    assert keep(0, [0.5], [100.0]).input == pytest.approx([5.0])
    assert keep(0, [0.5], [-100.0]).input == pytest.approx([-15.0])


def into_zeros(x, u):
    after = np.zeros_like(x)
    after[0], after[1] = x[0] + TICK * x[1], x[1] + TICK * u[0]
    return after


def into_a_copy(x, u):
    after = np.array(x)
    after[0] += TICK * x[1]
    after[1] += TICK * u[0]
    return after


def in_place(x, u):
    x[0] += TICK * x[1]
    x[1] += TICK * u[0]
    return x


@pytest.mark.parametrize("step", [into_zeros, into_a_copy, in_place, lambda x, u: tuple(cart(x, u))])
def test_a_step_may_write_into_arrays_made_from_its_arguments(step):
    system, barrier = Own(step), position()
    at = [1, 1]  # whole numbers, which an array of their kind would round
    assert rollout(system, 0, at, [[1], [1]]) == pytest.approx(rollout(CART, 0, at, [[1], [1]]))
    assert BarrierFilter(system, [barrier])(0, X, [1.0]).input == pytest.approx([-0.5])
    for found, expected in zip(enforced_psi(barrier, system, 0, X, [0.3]), enforced_psi(barrier, CART, 0, X, [0.3]),
                               strict=True):  # fmt: skip
        assert found == pytest.approx(expected)
    assert np.array_equal(X, [0.9, 0.3])


@pytest.mark.parametrize("door", TAKES_A_SYSTEM)
@pytest.mark.parametrize(("step", "text"), [
    (lambda x, u: cart(x, u)[:, None], "the system's step: x(k+1) must have shape (2,), given (2, 1)"),
    (lambda x, u: cart(x, u)[:1], "the system's step: x(k+1) must have shape (2,), given (1,)"),
    (lambda x, u: None, "the system's step: x(k+1) must be an array of numbers, given None"),
])  # fmt: skip
def test_what_step_returns_is_checked_everywhere(door, step, text):
    assert message(lambda: TAKES_A_SYSTEM[door](position(), Own(step))) == text


@pytest.mark.parametrize("door", [door for door in DOORS if door != "enforced_psi"])
@pytest.mark.parametrize(("system", "text"), [
    (Own(cart, period=1.0), "the system: the period is a whole number, at least 1, given 1.0"),
    (Own(cart, n=2.0), "the system: the number of states is a whole number, at least 1, given 2.0"),
    (Own(cart, m=0), "the system: the number of inputs is a whole number, at least 1, given 0"),
    (None, "a system has period, n, m and step(k, x, u), given None without period"),
])  # fmt: skip
def test_a_system_has_whole_sizes_everywhere(door, system, text):
    assert message(lambda: DOORS[door](position(), system)) == text


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize(("h", "given"), [
    (lambda k, x: (1.0 - x)[:1], "of shape (1,)"),
    (lambda k, x: None, "given None"),
    (lambda k, x: (1.0,), "given (1.0,)"),
    (lambda k, x: x[0] > 0, "given"),
    (lambda k, x: "1", "given '1'"),
])  # fmt: skip
def test_what_h_returns_is_checked_everywhere(door, h, given):
    text = message(lambda: DOORS[door](Barrier("p", h, 1, [0.5, 0.5]), CART))
    assert text.startswith('barrier "p": h must be one number, given ')
    assert given in text


def test_an_array_without_axes_is_one_number():
    barrier = Barrier("p", lambda k, x: np.array(1.0 - x[0]), 1, [0.5, 0.5])
    assert BarrierFilter(CART, [barrier])(0, X, [1.0]).input == pytest.approx([-0.5])


P = position()
TEXTS = {
    'barrier "p": h is a function of the tick k and the state x, given one that takes (x)':
        lambda: Barrier("p", lambda x: 1.0 - x[0], 1, [0.5]),
    'barrier "p": h is a function of the tick k and the state x, given one that takes (a, k, x)':
        lambda: Barrier("p", lambda a, k, x: 1.0 - x[0], 1, [0.5]),
    'barrier "p": h raises IndexError (index 5 is out of bounds for axis 0 with size 2) after tick 0 from the state '
    "[0.1257302210933933, -0.1321048632913019]":
        lambda: BarrierFilter(CART, [Barrier("p", lambda k, x: x[5], 1, [0.5, 0.5])]),
    'barrier "p": the dynamics raise ZeroDivisionError (division by zero) after tick 0 from the state '
    "[0.1257302210933933, -0.1321048632913019]":
        lambda: BarrierFilter(Own(lambda x, u: 1 / 0), [P]),
    "the barriers are a list, given Barrier('p', period=1, class_k=(Linear(gamma=0.5), Linear(gamma=0.5)))":
        lambda: BarrierFilter(CART, P),
    "the barriers are a list of Barrier or AffineBarrier, given 'p' in it": lambda: NonlinearFilter(CART, ["p"]),
    "the barriers are a list, given None": lambda: input_interval(CART, None, 0, X),
    'barrier "p": the period is a whole number of ticks, at least 1, given 1.0':
        lambda: Barrier("p", lambda k, x: 1.0 - x[0], 1.0, [0.5]),
    "the tick k is a whole number of ticks, given 1.5": lambda: constant(1.0).samples(1.5, 2),
    "the number of ticks is a whole number of ticks, given 2.5": lambda: constant(1.0).samples(1, 2.5),
    "the tick k is a whole number of ticks, given 'a'": lambda: CART.A("a"),
    "the tick k is a whole number of ticks, given nan": lambda: P.h(float("nan"), X),
    "the tick k is a whole number of ticks, given 0.5": lambda: BarrierFilter(CART, [P])(0.5, X, [1.0]),
    'barrier "p": the sign is +1 (upper bound) or -1 (lower bound), given array([1, 1])':
        lambda: AffineBarrier("p", [1.0, 0.0], constant(1.0), np.array([1, 1]), [0.5]),
    'barrier "p", class-K function 1: alpha(0) must be one number, given None':
        lambda: Barrier("p", lambda k, x: 1.0 - x[0], 1, [lambda s: None]),
    'barrier "p", class-K function 1: alpha(0) raised KeyError (0.0); it takes one number':
        lambda: Barrier("p", lambda k, x: 1.0 - x[0], 1, [lambda s: {}[s]]),
}  # fmt: skip


@pytest.mark.parametrize("text", TEXTS)
def test_wrong_arguments_are_refused_in_one_sentence(text):
    assert message(TEXTS[text]) == text


def masked(values, mask):
    return np.ma.masked_array(values, mask)


@pytest.mark.parametrize("call", [
    lambda: BarrierFilter(CART, [P])(0, masked([0.9, 0.3], [0, 1]), [1.0]),
    lambda: BarrierFilter(CART, [P])(0, X, masked([1.0], [1])),
    lambda: BarrierFilter(CART, [P], masked([-1.0], [1]), [1.0]),
    lambda: AffineBarrier("p", masked([1.0, 0.0], [0, 1]), constant(1.0), 1, [0.5]),
    lambda: PeriodicAffineSystem(masked(np.eye(2), np.eye(2)), [[0.0], [1.0]]),
    lambda: PeriodicAffineSystem([masked([1.0, 0.0], [0, 1]), [0.0, 1.0]], [[0.0], [1.0]]),
    lambda: tabulated(masked([1.0, 2.0], [0, 1])),
    lambda: constant(np.ma.masked),
    lambda: record(P, masked([[0.0, 0.0]], [[0, 1]])),
    lambda: record_from_h(masked([1.0, 2.0], [0, 1]), [0.5]),
    lambda: rollout(CART, 0, X, masked([[1.0]], [[1]])),
])  # fmt: skip
def test_masked_entries_are_refused(call):
    assert "must be an array of numbers, given one with masked entries: " in message(call)


def test_a_masked_array_without_masked_entries_is_an_array():
    assert BarrierFilter(CART, [P])(0, masked([0.9, 0.3], [0, 0]), [1.0]).input == pytest.approx([-0.5])


def test_class_k_functions_need_not_take_autodiff_in_a_filter():
    plain, drakes = (lambda s: 0.5 * math.tanh(s)), Saturating(0.5, 1.0)
    for make in (BarrierFilter, NonlinearFilter):
        given, known = (
            make(CART, [Barrier("p", lambda k, x: 1.0 - x[0], 1, [alpha] * 2)])(0, X, [1.0])
            for alpha in (plain, drakes)
        )
        assert given.input == pytest.approx(known.input, rel=1e-12)
    assert "a class-K function, h or the dynamics cannot take AutoDiffXd" in message(
        lambda: rows(Barrier("p", lambda k, x: 1.0 - x[0], 1, [plain] * 2), CART)
    )


@pytest.mark.parametrize("make", [BarrierFilter, NonlinearFilter])
def test_a_function_that_raises_in_the_loop_fails_in_a_defined_way(make):
    far = Barrier("p", lambda k, x: 1.0 - x[0] if x[0] < 50 else 1 / 0, 1, [0.5, 0.5])
    result = make(CART, [far], upper=[0.5])(0, [60.0, 0.0], [1.0])
    assert result.status == "failed"
    assert result.input.tolist() == [0.5]
    assert result.reason == (
        'barrier "p": h raises ZeroDivisionError (division by zero) after tick 0 from the state [60.0, 0.0]'
    )


@pytest.mark.parametrize(
    "part", [CART.A(0), CART.B(0), CART.c(0), AffineBarrier("p", [1.0], constant(1), 1, [1]).normal]
)
def test_what_is_handed_out_can_not_be_written_to(part):
    with pytest.raises(ValueError, match="read-only"):
        part[...] = 5.0


def test_functions_are_checked_where_they_are_defined():
    """h = log(log x_1 − 3) is a number only above e³, where no random state is."""
    log = Barrier("log", lambda k, x: np.log(np.log(x[0]) - 3.0), 1, [0.5, 0.5])
    at = [[30.0, 0.0], [40.0, 0.1]]
    with np.errstate(invalid="ignore"):
        assert "give states at which they are" in message(lambda: NonlinearFilter(CART, [log]))
        assert NonlinearFilter(CART, [log], states=at).barriers == (log,)
        assert not in_safe_set(log, CART, 0, at[0])  # at a state of its own


def test_long_things_are_shown_on_one_line():
    found = record(P, np.zeros((2000, 2)))
    assert repr(found) == "BarrierRecord(h_min=1, h_mean=1, violations=0 of 2000 ticks, psi_min=0.25)"
    assert repr(tabulated([1.0, 2.0])) == "Bound((1.0, 2.0))"
    assert repr(tabulated(np.arange(2000.0))) == "Bound(<2000 values from 0 to 1999>)"
