"""Robust barriers keep h ≥ 0 of the true state: the worst of all disturbances and errors, found exactly."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.barriers import (
    AffineBarrier,
    Barrier,
    BarrierFilter,
    PeriodicAffineSystem,
    check_relative_degree,
    robust_barrier,
    tabulated,
)
from pdhocbf_drake.barriers.relative_degree import enforced_row
from pdhocbf_drake.errors import InputError

PERIOD, TICKS = 4, 20
RANDOM = np.random.default_rng(7)
COUPLED, SLOPES = 0.1 * RANDOM.normal(size=(PERIOD, 3, 3)), RANDOM.normal(size=(2 * PERIOD, 2))


def chain() -> PeriodicAffineSystem:
    """x_1 ← x_2 ← x_3 ← u, coupled a little and anew at each phase, where that leaves the relative degrees."""
    A = np.array([[[1.0, 0.4, 0.0], [0.0, 1.0, 0.4], [0.0, 0.0, 1.0]]] * PERIOD) + np.tril(COUPLED)
    return PeriodicAffineSystem(A, [[0.0], [0.0], [1.0]], 0.05 * COUPLED[:, 0])


def barrier_of(degree: int, gammas: tuple[float, ...]) -> AffineBarrier:
    """One with a moving normal and bound that sees u after `degree` ticks."""
    normals = np.zeros((2 * PERIOD, 3))
    normals[:, 3 - degree] = 1.0 + 0.3 * SLOPES[:, 0]
    if degree < 3:
        normals[:, 0] += 0.5 * SLOPES[:, 1]
    bound = tabulated(1.0 + 0.1 * SLOPES[:PERIOD, 1])
    return AffineBarrier("b", normals, bound, -1, gammas, relative_degree=degree)


def walked(system, barrier, robust, delay, moved, missed):
    """h of the true states where u makes the enforced ψ_m of `robust` 0, its least allowed value, at every tick.

    Args:
        moved, missed: w(k) and e(k), (T, n). The start has ψ_i = 0 of the robust barrier for all i < m.
    """
    ahead = barrier.relative_degree
    on, right = np.zeros((ahead, 3)), np.zeros(ahead)
    for i in range(ahead):  # h(i) of `robust` along the undisturbed walk from 0 and 1 of each state
        states = [np.zeros(3), *np.eye(3)]
        for k in range(i):
            states = [system.step(k, x, np.zeros(1)) for x in states]
        values = [robust.h(i, x) for x in states]
        on[i], right[i] = np.array(values[1:]) - values[0], values[0]
    true = [np.linalg.lstsq(on, -right, rcond=None)[0]]  # h(0) = … = h(r − 1) = 0, so that ψ_i(0) = 0 for i < r
    inputs: list[np.ndarray] = []
    for k in range(TICKS):
        first = max(k - delay, 0)
        believed = true[first] + missed[first]
        for i in range(first, k):
            believed = system.step(i, believed, inputs[i])
        value, slope = enforced_row(robust, system, k, believed, np.zeros(1))
        inputs.append(-value / slope)
        true.append(system.step(k, true[k], inputs[k]) + moved[k])
    return np.array([barrier.h(k, x) for k, x in enumerate(true)])


@pytest.mark.parametrize("delay", [0, 2])
@pytest.mark.parametrize("error", [0.0, 0.02])
@pytest.mark.parametrize(
    ("degree", "gammas"),
    [(1, (0.6,)), (2, (0.6,)), (2, (0.4, 0.7)), (3, (0.6,)), (3, (0.3, 0.6)), (3, (0.3, 0.6, 1.0))],
)
def test_the_worst_of_all_disturbances_and_errors_never_breaks_a_robust_barrier(degree, gammas, error, delay):
    system, barrier = chain(), barrier_of(degree, gammas)
    check_relative_degree(barrier, system)
    disturbance, estimate = np.array([0.01, 0.02, 0.03]), error * np.array([1.0, 0.5, 2.0])
    robust = robust_barrier(barrier, system, disturbance, estimate, delay)
    none = np.zeros((TICKS, 3))
    undisturbed = walked(system, barrier, robust, delay, none, none)
    # The closed loop is affine in w and e, so that the least h at each tick is exactly:
    worst = undisturbed.copy()
    for k in range(TICKS):
        for i in range(3):
            one = none.copy()
            one[k, i] = 1.0
            worst -= disturbance[i] * np.abs(walked(system, barrier, robust, delay, one, none) - undisturbed)
            if error:
                worst -= estimate[i] * np.abs(walked(system, barrier, robust, delay, none, one) - undisturbed)
    assert worst.min() >= -1e-9
    plain = walked(system, barrier, barrier, delay, none, none)
    assert plain.min() < 1e-9  # the loop is at the edge, so that without tightening any disturbance breaks it
    if len(gammas) == 1 and not error:
        assert worst[-8:].min() <= 1e-6  # and it takes no more than is needed


@pytest.mark.parametrize("delay", [0, 1])
def test_a_disturbance_of_each_tick_is_withstood_and_costs_less_than_its_largest_at_every_tick(delay):
    system, barrier = chain(), barrier_of(3, (0.3, 0.6, 1.0))
    pattern = 0.01 * np.abs(RANDOM.normal(size=(6, 3))) * [[1.0], [8.0], [0.0], [1.0], [1.0], [2.0]]
    robust = robust_barrier(barrier, system, pattern, None, delay)
    none = np.zeros((TICKS, 3))
    undisturbed = walked(system, barrier, robust, delay, none, none)
    worst = undisturbed.copy()
    for k in range(TICKS):
        for i in range(3):
            one = none.copy()
            one[k, i] = pattern[k % 6, i]
            worst -= np.abs(walked(system, barrier, robust, delay, one, none) - undisturbed)
    assert worst.min() >= -1e-9
    period = robust.bound.period
    sizes = [barrier.bound.samples(0, period) - each.bound.samples(0, period) for each in
             (robust, robust_barrier(barrier, system, pattern.max(axis=0), None, delay))]  # fmt: skip
    assert np.all(np.abs(sizes[0]) < np.abs(sizes[1]))
    assert robust_barrier(barrier, system, np.tile(pattern[:1], (6, 1))).bound.samples(0, period) == pytest.approx(
        robust_barrier(barrier, system, pattern[0]).bound.samples(0, period)
    )


def test_order_one_without_delay_is_the_textbook_s_margin():
    # h ≥ (1 − γ)^k h(0) − d̄/γ.
    system = PeriodicAffineSystem([[0.9]], [[1.0]])
    barrier = AffineBarrier("b", [2.0], tabulated([1.0]), 1, [0.25])
    nearer = robust_barrier(barrier, system, [0.03])
    assert nearer.bound.values == pytest.approx([1.0 - 2.0 * 0.03 / 0.25])


def test_no_uncertainty_leaves_a_barrier_as_it_is():
    barrier = barrier_of(2, (0.4, 0.7))
    assert robust_barrier(barrier, chain(), np.zeros(3), None, 3) is barrier


def least_h(barrier, robust, ticks=200):
    """The least h of the true states under a filter that is driven into the barrier, at random corners."""
    system, disturbance, estimate = chain(), np.array([0.01, 0.02, 0.03]), np.array([0.01, 0.0, 0.02])
    given = {"disturbance": disturbance, "estimate": estimate} if robust else {}
    keep = BarrierFilter(system, [barrier], **given)
    random, x, least = np.random.default_rng(1), np.array([1.0, 3.0, 3.0]), np.inf
    for k in range(ticks):
        found = keep(k, x + estimate * random.choice([-1.0, 1.0], 3), [-1e3])
        assert found.status == "solved"
        x = system.step(k, x, found.input) + disturbance * random.choice([-1.0, 1.0], 3)
        least = min(least, barrier.h(k + 1, x))
    return least


def test_a_filter_keeps_the_true_state_safe_under_random_corners():
    barrier = barrier_of(2, (0.5, 0.5))
    assert least_h(barrier, robust=False) < 0.0 <= least_h(barrier, robust=True)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"disturbance": [0.1]}, "the disturbance is 3 half-widths ≥ 0, one for each state, or as many for each tick"),
        ({"disturbance": [[0.1, 0.1]]}, "the disturbance is 3 half-widths ≥ 0"),
        ({"disturbance": [0.1, -0.1, 0.0]}, "the disturbance is 3 half-widths ≥ 0"),
        ({"estimate": [0.1]}, "the estimate is 3 half-widths ≥ 0"),
        ({"estimate": [0.1, 0.1, 0.1], "delay": -1}, "the delay"),
    ],
)
def test_what_can_not_be_an_uncertainty_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        BarrierFilter(chain(), [barrier_of(1, (0.5,))], **given)


def test_other_barriers_take_a_tightening_instead():
    round_one = Barrier("disc", lambda k, x: 1.0 - x[2] ** 2, 1, [0.5])
    with pytest.raises(InputError, match="as the tightening"):
        BarrierFilter(chain(), [round_one], disturbance=[0.1, 0.1, 0.1], lower=[-1.0], upper=[1.0])
