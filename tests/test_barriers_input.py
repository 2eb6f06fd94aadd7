"""Arguments that the barriers' public functions refuse in one sentence, before Drake gets them."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.solvers import MathematicalProgram

from pdhocbf_drake.barriers import (
    AffineBarrier,
    Barrier,
    BarrierFilter,
    Bound,
    Linear,
    PeriodicAffineSystem,
    Saturating,
    add_barrier_rows,
    add_dynamics,
    add_nonlinear_barrier_rows,
    affine_rows,
    check_in_safe_set,
    check_relative_degree,
    constant,
    enforced_psi,
    feasible_width,
    harmonic,
    input_interval,
    make_bound,
    margin_ratio,
    psi,
    psi_along,
    psi_from_h,
    record,
    rollout,
    safety_margin,
    tabulated,
)
from pdhocbf_drake.barriers.config import BoundConfig
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.oscillator.van_der_pol import VanDerPol, harmonic_orbit, limit_cycle, orbit_through
from pdhocbf_drake.walking.vhip import Vhip

NAN, INF = float("nan"), float("inf")
SYSTEM = PeriodicAffineSystem([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]])
CONFIG = BoundConfig(kind="constant", value=1.0)


def barrier(normal=(1.0, 0.0), class_k=(0.5, 0.5), bound=None, relative_degree=None):
    return AffineBarrier("p", normal, constant(1.0) if bound is None else bound, 1, class_k, "m", relative_degree)


P = barrier()
PLAIN = Barrier("p", lambda k, x: x[0], 1, (0.5, 0.5))


def message(call):
    with pytest.raises(InputError) as caught:
        call()
    return str(caught.value)


def rows(one=P, x=(0.0, 0.0), add=add_barrier_rows, **keys):
    prog = MathematicalProgram()
    return add(prog, one, SYSTEM, 0, list(x), prog.NewContinuousVariables(10, 1, "u"), **keys)


def dynamics(states, inputs):
    prog = MathematicalProgram()
    return add_dynamics(
        prog, SYSTEM, 0, prog.NewContinuousVariables(*states, "x"), prog.NewContinuousVariables(*inputs, "u")
    )


@pytest.mark.parametrize("add", [add_barrier_rows, add_nonlinear_barrier_rows])
@pytest.mark.parametrize("bad", [NAN, INF, -5.0, "a", None, [0.0, 0.0], True])
def test_a_tightening_is_finite_and_not_negative(add, bad):
    assert message(lambda: rows(add=add, tightening=bad)) == (
        f'barrier "p": the tightening must be a finite number, at least 0, given {bad!r}'
    )
    assert message(lambda: BarrierFilter(SYSTEM, [P], tightening=bad)) == (
        f"the tightening must be a finite number, at least 0, given {bad!r}"
    )


@pytest.mark.parametrize("bad", [NAN, INF])
def test_a_state_that_is_not_finite_is_refused_before_drake_gets_it(bad):
    """Drake ends the process on a NaN in a constraint, and without one every input would look safe."""
    assert message(lambda: rows(x=[bad, 0.0])) == f'barrier "p": x0 must be finite, given {bad} in it'
    assert message(lambda: rows(x=[bad, 0.0], add=add_nonlinear_barrier_rows)) == (
        f'barrier "p": the states must be finite, given {bad} in it'
    )
    assert message(lambda: input_interval(SYSTEM, [P], 0, [bad, 0.0])) == (
        f"the state x must be finite, given {bad} in it"
    )


def test_a_barrier_that_is_no_number_allows_no_input():
    nowhere = Barrier("root", lambda k, x: NAN * x[0], 1, (0.5, 0.5))
    assert input_interval(SYSTEM, [nowhere], 0, [0.0, 0.0]) == (INF, -INF)


def test_rows_need_the_relative_degree_of_the_dynamics():
    """ψ_1 of a double integrator's position takes its input a tick late, and ψ_2 declared with 3 not late enough."""
    assert message(lambda: rows(barrier(class_k=(0.5,)))) == (
        'barrier "p": relative degree 1 is declared by 1 class-K function, but the dynamics give 2 (at every phase)'
    )
    assert message(lambda: rows(barrier(relative_degree=3))) == (
        'barrier "p": relative degree 3 is declared, but the dynamics give 2 (at every phase)'
    )
    assert rows(barrier(class_k=(0.5,), relative_degree=2)).evaluator().num_constraints() == 9


TEXTS = {
    'barrier "p": the declared relative degree is a whole number of ticks, at least 1, given 2.5':
        lambda: barrier(relative_degree=2.5),
    'barrier "p": the declared relative degree is a whole number of ticks, at least 1, given \'2\'':
        lambda: barrier(relative_degree="2"),
    'barrier "p": the declared relative degree is a whole number of ticks, at least 1, given nan':
        lambda: barrier(relative_degree=NAN),
    'barrier "p": the class-K functions are a list, given 0.5': lambda: barrier(class_k=0.5),
    'barrier "p": the normal must be an array of numbers, given \'ab\'': lambda: barrier("ab"),
    'barrier "p": the normal must be finite, given nan in it': lambda: barrier([NAN, 0.0]),
    'barrier "p": the bound is made by constant, harmonic or tabulated, given 1.0': lambda: barrier(bound=1.0),
    'barrier "x": h is a function of the tick k and the state x, given 3': lambda: Barrier("x", 3, 2, [0.5]),
    'barrier "x": the period is a whole number of ticks, at least 1, given True':
        lambda: Barrier("x", lambda k, x: 0.0, True, [0.5]),
    # bounds
    "a bound must be an array of numbers, given ('a',)": lambda: constant("a"),
    "a bound is a list of numbers, one per tick, given 1.0": lambda: Bound(1.0),
    "a bound is a list of numbers, one per tick, given [True]": lambda: Bound([True]),
    "a tabulated bound must be an array of numbers, given 'abc'": lambda: tabulated("abc"),
    "a tabulated bound must be an array of numbers, given [1, [2]]": lambda: tabulated([1, [2]]),
    "a coefficient of a harmonic bound must be a finite number, given 'a'": lambda: harmonic("a", 0, 0, 4),
    "the period of a bound is a whole number of ticks, at least 1 and at most 1000000, given 1000000000":
        lambda: harmonic(0, 0, 0, 10**9),
    "the period of a bound is a whole number of ticks, at least 1, given 0": lambda: make_bound(CONFIG, 0),
    "the tick k of a bound is a whole number of ticks, given 1.5": lambda: constant(1.0)(1.5),
    # dynamics
    "A must be an array of numbers, given [[1, 0.1], [0]]": lambda: PeriodicAffineSystem([[1, 0.1], [0]], [[0], [1]]),
    "A must have shape (period, n, n) or (n, n), given (0, 2, 2)":
        lambda: PeriodicAffineSystem(np.zeros((0, 2, 2)), np.zeros((0, 2, 1))),
    "B must have shape (period, 2, m) or (2, m), given (2, 0)":
        lambda: PeriodicAffineSystem(np.eye(2), np.zeros((2, 0))),
    "a pydrake LinearSystem or AffineSystem is needed, given None": lambda: PeriodicAffineSystem.from_drake(None),
    # the state's and the inputs' sizes
    "the state x must have shape (2,), given (3,)": lambda: rollout(SYSTEM, 0, [0, 0, 0], [[1]]),
    "the state x must be an array of numbers, given ['a', 0]": lambda: BarrierFilter(SYSTEM, [P])(0, ["a", 0], [0]),
    "the inputs must have shape (T, 1), given (1, 3)": lambda: psi(P, SYSTEM, 0, [0, 0], [[1, 2, 3]]),
    "the inputs must be an array of numbers, given [1, 'a']": lambda: rollout(SYSTEM, 0, [0, 0], [1, "a"]),
    "the input u must have shape (1,), given (2,)": lambda: enforced_psi(P, SYSTEM, 0, [0, 0], [0, 1]),
    'barrier "p": psi_2 takes the inputs of 2 ticks at most, given 3':
        lambda: psi(P, SYSTEM, 0, [0, 0], [[1], [2], [3]]),
    "the wanted input must have shape (1,), given (2,)": lambda: BarrierFilter(SYSTEM, [P])(0, [0, 0], [1, 2]),
    "input limits must be two vectors of 1, lower <= upper, given [inf] and None":
        lambda: BarrierFilter(SYSTEM, [P], lower=[INF]),
    'barrier "p": the normal has 3 entries, but the system 2 states':
        lambda: check_relative_degree(barrier([1.0, 0.0, 0.0]), SYSTEM),
    "the tick k is a whole number of ticks, given 1.5": lambda: psi(P, SYSTEM, 1.5, [0, 0], [[1]]),
    "the states must have shape (S, 2), given (1, 3)": lambda: check_relative_degree(PLAIN, SYSTEM, [[0, 0, 0]]),
    # rows
    'barrier "p": the tick k is a whole number of ticks, given 1.5': lambda: affine_rows(P, SYSTEM, 1.5, 5),
    'barrier "p": the horizon is a whole number of ticks, given 5.5': lambda: affine_rows(P, SYSTEM, 0, 5.5),
    "linear rows need an AffineBarrier on a PeriodicAffineSystem, given "
    "Barrier('p', period=1, class_k=(Linear(gamma=0.5), Linear(gamma=0.5))) on a PeriodicAffineSystem; "
    "add_nonlinear_barrier_rows takes any": lambda: affine_rows(PLAIN, SYSTEM, 0, 5),
    'barrier "p": slacks must be decision variables, given 0.1': lambda: rows(slack=0.1),
    'barrier "p": the inputs must be decision variables, given 1.0':
        lambda: add_barrier_rows(MathematicalProgram(), P, SYSTEM, 0, [0, 0], np.ones((5, 1))),
    "dynamics over H ticks need states (H+1, 2) and inputs (H, 1), given (3, 2) and (5, 1)":
        lambda: dynamics((3, 2), (5, 1)),
    # joint feasibility
    'barrier "p": class-K function 2 is Saturating(gamma=0.5, scale=0.1), but affine rows need linear ones; '
    "add_nonlinear_barrier_rows takes any":
        lambda: feasible_width(SYSTEM, [barrier(class_k=(0.5, Saturating(0.5, 0.1)))], 0),
    # records
    "the recorded states must have shape (T, n), given (2,)": lambda: record(P, [0, 0]),
    "a record of h must be an array of numbers, given 'abc'": lambda: safety_margin("abc"),
    "the mean of the recorded h is not finite; its largest is 1e+308": lambda: safety_margin([1e308] * 3),
    "the safety margin ratio needs a second margin other than zero, given 9.99989e-321":
        lambda: margin_ratio([1.0], [1e-320]),
    "the recursion needs at least one value of h, given none": lambda: psi_from_h([], [Linear(0.5)]),
    "a record of h is a list of numbers, given shape (1, 2)": lambda: psi_along([[1.0, 2.0]], [0.5]),
    # templates
    "Van der Pol: beta must be a finite number, at least 0, given 'a'": lambda: VanDerPol("a", 0.1),
    "Van der Pol: the tick must be a finite number, given None": lambda: VanDerPol(0.0, None),
    "Van der Pol: the tick must be positive, given 0.0": lambda: orbit_through([1.0, 2.0], 0.0),
    "Van der Pol: the positions of an orbit must be finite, given nan in it": lambda: orbit_through([1.0, NAN], 0.1),
    "Van der Pol: the period of an orbit is a whole number of ticks, at least 2, given 0":
        lambda: harmonic_orbit(1.0, 0, 0.1),
    "Van der Pol: the period of an orbit is a whole number of ticks, at least 2, given 66.7":
        lambda: limit_cycle(VanDerPol(1.0, 0.1), 66.7),
    "eta must be an array of numbers, given 'a'": lambda: Vhip("a", 0.01),
    "eta: a row of positive numbers over one period is needed, given []": lambda: Vhip([], 0.01),
    "the tick of the pendulum must be positive, given -1.0": lambda: Vhip(np.ones(3), -1.0),
    "the tick of the pendulum must be a finite number, given nan": lambda: Vhip(np.ones(3), NAN),
    "the flow of the pendulum is one of euler, exact, given 'foo'": lambda: Vhip(np.ones(3), 0.01, "foo"),
}  # fmt: skip


@pytest.mark.parametrize("text", TEXTS)
def test_bad_input_is_refused_in_one_sentence(text):
    assert message(TEXTS[text]) == text


def test_rows_that_overflow_are_refused_before_drake_gets_them():
    opposed = [barrier([1e308, 0.0]), AffineBarrier("q", [-1e308, 0.0], constant(1e308), 1, (0.5, 0.5))]
    fast = PeriodicAffineSystem(1e200 * np.ones((2, 2)), [[0.0], [1.0]])
    with np.errstate(all="ignore"):
        assert message(lambda: affine_rows(P, fast, 0, 9)) == (
            'barrier "p": the rows over 9 ticks are too large for floating point'
        )
        assert message(lambda: rows(barrier([1e200, 0.0]), [1e200, 0.0])) == (
            'barrier "p": the rows are too large for floating point at this x0'
        )
        assert message(lambda: feasible_width(SYSTEM, opposed, 0)) == (
            "the limits of barriers q and p are too large for floating point"
        )


@pytest.mark.parametrize(
    "call",
    [
        lambda x: psi(P, SYSTEM, 0, x, [[1.0]]),
        lambda x: check_in_safe_set(P, SYSTEM, 0, x),
        lambda x: BarrierFilter(SYSTEM, [P])(0, x, [1.0]),
        lambda x: input_interval(SYSTEM, [P], 0, x),
        lambda x: enforced_psi(P, SYSTEM, 0, x, [1.0]),
        lambda x: record(P, [x]),
    ],
)
def test_a_state_of_another_size_is_named(call):
    assert message(lambda: call([0.0, 0.0, 0.0])) in (
        "the state x must have shape (2,), given (3,)",
        'barrier "p": the normal has 2 entries, but the system 3 states',
    )


def test_an_h_that_is_no_number_is_not_mistaken_for_one_without_input():
    nowhere = Barrier("x", lambda k, x: NAN * x[0], 1, (0.5, 0.5))
    assert message(lambda: check_relative_degree(nowhere, SYSTEM)) == (
        'barrier "x": h or its derivative in the input is not finite at the 4 states tried; '
        "give states at which they are"
    )
    # ... and states at which it is a number decide
    half = Barrier("half", lambda k, x: np.log(x[0]), 1, (0.5, 0.5))
    with np.errstate(invalid="ignore"):
        assert check_relative_degree(half, SYSTEM, [[-1.0, 0.0], [2.0, 0.0]]) == (2,)


def test_a_long_value_is_cut_in_a_message():
    assert message(lambda: constant("a" * 1000)).endswith("aaa...")
    assert len(message(lambda: constant("a" * 1000))) < 200


def test_a_bound_keeps_its_own_values():
    values = [1.0, 2.0]
    bound = Bound(values)
    values[0] = 5.0
    assert bound.values == (1.0, 2.0)
    assert bound == Bound(np.array([1.0, 2.0]))
    assert hash(bound)


def test_no_barriers_leave_every_input():
    assert feasible_width(SYSTEM, [], 0).width == INF
    assert input_interval(SYSTEM, [], 0, [0.0, 0.0]) == (-INF, INF)


def test_plain_rates_serve_a_record_as_they_serve_a_barrier():
    h = [1.0, 0.8, 0.9, 0.4]
    for plain, made in zip(psi_along(h, [0.5, 0.2]), psi_along(h, [Linear(0.5), Linear(0.2)]), strict=True):
        assert np.array_equal(plain, made)
    assert np.array_equal(psi_from_h(h[:3], [0.5, 0.2]), psi_from_h(h[:3], [Linear(0.5), Linear(0.2)]))
