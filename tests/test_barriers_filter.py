"""The safety filter, the joint feasibility of barriers that share an input, and margins along a record."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.barriers import (
    AffineBarrier,
    Barrier,
    BarrierFilter,
    PeriodicAffineSystem,
    Saturating,
    constant,
    feasible_width,
    harmonic,
    in_safe_set,
    initial_psi,
    input_interval,
    margin_ratio,
    psi,
    record,
    record_from_h,
    safety_margin,
)
from pdhocbf_drake.errors import InputError

TICK = 0.05


class Pendulum:
    """θ⁺ = θ + δω, ω⁺ = ω + δ(−10 sin θ + u)."""

    period, n, m = 1, 2, 1

    def step(self, k, x, u):
        return np.array([x[0] + TICK * x[1], x[1] + TICK * (-10 * np.sin(x[0]) + u[0])])


def pendulum_barriers():
    angle = AffineBarrier("angle", [1.0, 0.0], harmonic(0.5, 0.1, 0.0, 40), 1, (0.3, Saturating(0.3, 0.2)), "rad")
    # the lower angle with ψ_1 alone, which the torque reaches a tick late
    other = AffineBarrier("other", [1.0, 0.0], constant(-0.5), -1, (0.3,), "rad", relative_degree=2)
    return [angle, other]


def test_filter_keeps_a_pendulum_in_its_barriers():
    """Pushed up with a constant torque for 300 ticks: h ≥ 0 throughout, and the free pendulum violates it."""
    wanted, x, free = np.array([8.0]), np.zeros(2), np.zeros(2)
    barriers = pendulum_barriers()
    barrier_filter = BarrierFilter(Pendulum(), barriers)
    states, frees, statuses = [x], [free], set()
    for k in range(300):
        result = barrier_filter(k, x, wanted * (-1) ** (k // 100))
        statuses.add(result.status)
        assert result.psi[0] == pytest.approx(psi(barriers[0], Pendulum(), k, x, result.input)[-1], abs=1e-12)
        x, free = Pendulum().step(k, x, result.input), Pendulum().step(k, free, wanted)
        states.append(x)
        frees.append(free)
    assert statuses == {"solved"}
    for barrier in barriers:
        assert record(barrier, states).h_min > -1e-9
    assert record(barriers[0], frees).h_min < -0.3
    # the filter acts only where it must
    assert record(barriers[0], states).h_min < 0.01


def test_filter_leaves_a_safe_input_alone_bit_for_bit():
    barrier_filter = BarrierFilter(Pendulum(), pendulum_barriers())
    assert barrier_filter(0, np.zeros(2), [0.1]).input.tolist() == [0.1]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_filtered_input_is_the_nearest_of_the_interval(seed):
    rng = np.random.default_rng(seed)
    x, wanted, k = rng.uniform(-0.5, 0.5, 2), rng.uniform(-20, 20), int(rng.integers(0, 40))
    barriers = pendulum_barriers()
    low, high = input_interval(Pendulum(), barriers, k, x)
    result = BarrierFilter(Pendulum(), barriers)(k, x, [wanted])
    if low <= high:
        assert result.status == "solved"
        assert result.input[0] == pytest.approx(np.clip(wanted, low, high), abs=1e-6)
        assert np.all(result.psi >= -1e-10)
        assert np.all(result.slack == 0)
    else:
        assert result.status == "softened"
        assert result.slack.max() > 0


def opposed(gap):
    """x must stay under 0 and above `gap`: impossible for gap > 0."""
    return [
        AffineBarrier("under", [1.0], constant(0.0), 1, (0.5,)),
        AffineBarrier("over", [1.0], constant(gap), -1, (0.5,)),
    ]


def test_infeasible_barriers_are_softened_with_a_reason():
    system = PeriodicAffineSystem([[1.0]], [[1.0]])
    result = BarrierFilter(system, opposed(1.0))(0, [0.5], [3.0])
    assert result.status == "softened"
    assert result.reason == "no input satisfies every barrier at once"
    assert result.input[0] == pytest.approx(-0.25, rel=1e-12)  # the first one is kept
    assert result.slack == pytest.approx([0.0, 0.5], rel=1e-12)
    assert BarrierFilter(system, opposed(-1.0))(0, [-0.5], [3.0]).status == "solved"


def test_a_row_without_input_at_this_state_is_not_called_solved():
    """h = 1 − x_1 x_2 has no gradient in u at x_1 = 0 but is violated there by its bound's fall alone."""
    system = PeriodicAffineSystem([[1.0, 0.0], [0.0, 1.0]], [[0.0], [1.0]])
    barrier = Barrier("product", lambda k, x: (-0.5 if k % 2 else 1.0) - x[0] * x[1], 2, (0.5,))
    result = BarrierFilter(system, [barrier])(0, [0.0, 2.0], [1.0])
    assert result.status == "softened"
    assert result.psi[0] == -1.0
    assert result.slack[0] == 1.0
    assert BarrierFilter(system, [barrier])(0, [1.0, 0.0], [1.0]).status == "solved"
    # at x_1 = 0 either no input helps or any does, at x_1 = 1 those with ψ_1 = −0.5 − u − 0.5 (1 − 0) ≥ 0
    assert input_interval(system, [barrier], 0, [0.0, 2.0]) == (np.inf, -np.inf)
    assert input_interval(system, [barrier], 1, [0.0, 2.0]) == (-np.inf, np.inf)
    assert input_interval(system, [barrier], 0, [1.0, 0.0]) == (-np.inf, -1.0)


def test_limits_of_the_input_hold_even_where_the_barrier_is_softened():
    system = PeriodicAffineSystem([[1.0]], [[1.0]])
    barrier_filter = BarrierFilter(system, opposed(-9.0), lower=[-0.1], upper=[0.1])
    result = barrier_filter(0, [1.0], [3.0])
    assert result.status == "softened"
    assert result.input[0] == pytest.approx(-0.1, abs=1e-6)
    assert result.slack[0] == pytest.approx(0.4, abs=1e-6)  # ψ_1 = −1.9·½… = −u − ½: 0.1 of it is had
    assert result.reason == "no input within its limits satisfies every barrier at once"
    assert barrier_filter(0, [-2.0], [3.0]).input.tolist() == [0.1]


def test_nearest_input_of_several_within_limits():
    """u = (u_1, u_2) with u_1 + u_2 ≤ 1 from the barrier and u_1 ≤ 0.2: the projection of (2, 1.5) is (0.2, 0.8)."""
    system = PeriodicAffineSystem([[1.0]], [[1.0, 1.0]])
    barrier = AffineBarrier("sum", [1.0], constant(1.0), 1, (1.0,))
    result = BarrierFilter(system, [barrier], upper=[0.2, 5.0])(0, [0.0], [2.0, 1.5])
    assert result.status == "solved"
    assert result.input == pytest.approx([0.2, 0.8], abs=1e-6)
    # without the limit the excess is shared
    assert BarrierFilter(system, [barrier])(0, [0.0], [2.0, 1.5]).input == pytest.approx([0.75, 0.25], abs=1e-6)
    # the answer is nearest to the wanted input, not to the clipped one
    wide = BarrierFilter(system, [barrier], upper=[1.0, 1.0])(0, [0.0], [4.0, 1.0])
    assert wide.input == pytest.approx([1.0, 0.0], abs=1e-6)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_measurement_that_is_not_finite_fails_in_a_defined_way(bad):
    barrier_filter = BarrierFilter(Pendulum(), pendulum_barriers(), lower=[-1.0], upper=[1.0])
    for x, wanted in (([bad, 0.0], [5.0]), ([0.0, 0.0], [bad])):
        result = barrier_filter(0, x, wanted)
        assert result.status == "failed"
        assert result.reason == "the state or the wanted input is not finite"
        assert np.all(np.abs(result.input) <= 1.0)


def test_tightening_withstands_a_disturbance():
    """|d| ≤ 0.02 on h: h ≥ 0 with ψ_1 ≥ 0.02, and not with ψ_1 ≥ 0."""
    system = PeriodicAffineSystem([[1.0]], [[1.0]])
    least = {}
    for tightening in (0.0, 0.02):
        barrier_filter = BarrierFilter(
            system, [AffineBarrier("x", [1.0], constant(1.0), 1, (0.5,))], tightening=tightening
        )
        x, h = np.array([0.0]), []
        for k in range(50):
            x = system.step(k, x, barrier_filter(k, x, [1.0]).input) + 0.02
            h.append(1.0 - x[0])
        least[tightening] = min(h)
    assert least[0.02] > -1e-9
    assert least[0.0] == pytest.approx(-0.02 / 0.5, abs=1e-3)


def test_an_input_that_keeps_less_than_the_tightening_is_moved():
    """ψ_1 = 1 − u at x = 0: u = 0.95 keeps h ≥ 0 but not ψ_1 ≥ 0.1, u = 0.9 is the nearest that does."""
    barrier = AffineBarrier("x", [1.0], constant(1.0), 1, (1.0,))
    barrier_filter = BarrierFilter(PeriodicAffineSystem([[1.0]], [[1.0]]), [barrier], tightening=0.1)
    result = barrier_filter(0, [0.0], [0.95])
    assert result.status == "solved"
    assert result.input[0] == pytest.approx(0.9, abs=1e-9)
    assert barrier_filter(0, [0.0], [0.89]).input[0] == 0.89


def test_a_failed_solve_returns_the_wanted_input_and_the_violation(monkeypatch):
    monkeypatch.setattr("pdhocbf_drake.barriers.filter.nearest_kept", lambda *problem: None)
    barrier = AffineBarrier("x", [1.0], constant(1.0), 1, (0.5,))
    system = PeriodicAffineSystem([[1.0]], [[1.0]])
    result = BarrierFilter(system, [barrier], upper=[2.0], tightening=0.25)(0, [0.0], [3.0])
    assert result.status == "failed"
    assert result.reason == "the active-set method did not end"
    assert (result.input[0], result.psi[0], result.slack[0]) == (2.0, -1.5, 1.75)


def test_an_input_that_bends_psi_at_one_phase_only_is_refused():
    class BentAtOddTicks:
        period, n, m = 2, 1, 1

        def step(self, k, x, u):
            return x + u + (k % 2) * u * u

    below = AffineBarrier("below", [1.0], constant(1.0), 1, (0.5,))
    with pytest.raises(InputError, match="psi_1 is not affine in the input"):
        BarrierFilter(BentAtOddTicks(), [below])


def test_the_filter_refuses_wrong_arguments():
    system = PeriodicAffineSystem([[1.0]], [[1.0]])
    square = Barrier("square", lambda k, x: 1 - x[0] ** 2, 1, (0.5,))
    one = AffineBarrier("one", [1.0], constant(1.0), 1, (0.5,))
    for build, text in (
        (lambda: BarrierFilter(system, [square]),
         'barrier "square": psi_1 is not affine in the input, which BarrierFilter needs; '
         "NonlinearFilter takes any"),
        (lambda: BarrierFilter(Pendulum(), [AffineBarrier("a", [1, 0], constant(1), 1, (0.5,))]),
         'barrier "a": relative degree 1 is declared by 1 class-K function, but the dynamics give 2 (at every phase)'),
        (lambda: BarrierFilter(system, []), "a filter needs one barrier at least, given none"),
        (lambda: BarrierFilter(system, [one, one]), "barriers need names of their own, given two of the name 'one'"),
        (lambda: BarrierFilter(system, [one], lower=[1.0], upper=[0.0]),
         "input limits must be two vectors of 1, lower <= upper, given [1.0] and [0.0]"),
        (lambda: input_interval(PeriodicAffineSystem(np.eye(2), np.eye(2)), [], 0, [0, 0]),
         "the interval of allowed inputs is for systems with one input, given one with 2"),
        (lambda: feasible_width(system, opposed(1.0), 0),
         "no state at tick 0 is in the safe sets of all of these barriers: under, over"),
    ):  # fmt: skip
        with pytest.raises(InputError) as caught:
            build()
        assert str(caught.value) == text


def test_worst_width_is_the_worst_of_the_safe_set():
    """Against sampling: no state of the safe set is worse, and the one named is as bad as said."""
    system = PeriodicAffineSystem([[1.0, 0.1], [-0.1, 1.0]], [[0.0], [0.1]])
    barriers = [
        AffineBarrier("x1+", [1, 0], harmonic(1.0, 0.1, 0.0, 9), 1, (0.5, 0.5)),
        AffineBarrier("x1-", [1, 0], constant(-1.0), -1, (0.5, 0.5)),
        AffineBarrier("x2+", [0, 1], constant(2.0), 1, (0.2,)),
        AffineBarrier("x2-", [0, 1], constant(-2.0), -1, (0.2,)),
    ]
    rng = np.random.default_rng(0)
    for k in (0, 4):
        worst = feasible_width(system, barriers, k)
        for barrier in barriers:
            assert min(initial_psi(barrier, system, k, worst.state).values()) > -1e-9
        low, high = input_interval(system, barriers, k, worst.state)
        assert high - low == pytest.approx(worst.width, abs=1e-6)
        widths = []
        for x in rng.uniform([-1, -2], [1.1, 2], (2000, 2)):
            if all(in_safe_set(barrier, system, k, x) for barrier in barriers):
                low, high = input_interval(system, barriers, k, x)
                widths.append(high - low)
        assert len(widths) > 100
        assert worst.width - 1e-6 <= min(widths) < worst.width + 1.5


def test_records_and_margins():
    barrier = AffineBarrier("x", [1.0], harmonic(1.0, 0.5, 0.0, 4), 1, (0.5, 0.25), "m")
    states = np.array([[0.0], [0.5], [1.0], [0.75], [0.0]])
    found = record(barrier, states, k=2)  # V̄ = 0.5, 1, 1.5, 1, 0.5
    assert found.h == pytest.approx([0.5, 0.5, 0.5, 0.25, 0.5])
    assert (found.h_min, found.h_mean, found.violations) == (0.25, pytest.approx(0.45), 0)
    psi_1 = [0.25, 0.25, 0.0, 0.375]
    assert found.psi[1] == pytest.approx(psi_1)
    assert found.psi_min == pytest.approx(min(b - 0.75 * a for a, b in pairwise(psi_1)))
    assert record(barrier, states + 0.6, k=2).violations == 5
    assert record_from_h([0.0, -1e-12, 1.0], barrier.class_k).violations == 1  # the edge is no violation
    assert np.isnan(record_from_h([1.0, 2.0], barrier.class_k).psi_min)
    assert safety_margin([1.0, 2.0, 6.0]) == 3.0
    assert margin_ratio([1.0, 2.0], [4.0, 2.0]) == 0.5  # M < 1: the first is the less conservative
    for call, text in (
        (lambda: safety_margin([]), "a record of h is a list of at least one number, given shape (0,)"),
        (lambda: record_from_h([1.0, np.nan], ()), "a record of h must be finite, given nan in it"),
        (lambda: margin_ratio([1.0], [0.0]), "the safety margin ratio needs a second margin other than zero, given 0"),
    ):
        with pytest.raises(InputError) as caught:
            call()
        assert str(caught.value) == text
