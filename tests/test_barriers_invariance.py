"""Invariance: any input with ψ_m ≥ 0 keeps h ≥ 0; bounds on h outside the safe set and under disturbances."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.barriers import (
    AffineBarrier,
    Linear,
    PeriodicAffineSystem,
    Saturating,
    check_relative_degree,
    in_safe_set,
    psi,
    psi_along,
    tabulated,
)

CYCLES = 4
unit = st.floats(0.0, 1.0)
class_k = st.one_of(
    st.builds(Linear, st.floats(0.05, 1.0)), st.builds(Saturating, st.floats(0.05, 1.0), st.floats(0.1, 3.0))
)


def chain(rng, m, period):
    """A periodic system in which the input needs m ticks to reach x_1, and a moving bound on it."""
    A = rng.uniform(-0.8, 0.8, (period, m, m))
    A = np.tril(A) + np.array([np.diag(rng.uniform(0.4, 1.2, m - 1) * rng.choice([-1, 1], m - 1), 1) for _ in A])
    B = np.zeros((period, m, 1))
    B[:, -1, 0] = rng.uniform(0.5, 1.5, period) * rng.choice([-1, 1], period)
    return PeriodicAffineSystem(A, B, rng.uniform(-0.5, 0.5, (period, m)))


def start_with(system, barrier, psis):
    """x(0) with ψ_i(0) = psis[i] for i < m: unfold h(0), …, h(m−1), then solve for the state."""
    h, level = [], list(psis)
    while level:
        h.append(level[0])
        # ψ_{i−1}(k+1) = ψ_i(k) + ψ_{i−1}(k) − α_i(ψ_{i−1}(k))
        level = [level[i + 1] + level[i] - barrier.class_k[i](level[i]) for i in range(len(level) - 1)]
    matrix, offset, target = [], [], []
    A, c = np.eye(system.n), np.zeros(system.n)
    for k, value in enumerate(h):
        matrix.append(barrier.normals(k, 1)[0] @ A)
        offset.append(barrier.normals(k, 1)[0] @ c)
        target.append(barrier.bound(k) - barrier.sign * value)
        A, c = system.A(k) @ A, system.A(k) @ c + system.c(k)
    return np.linalg.solve(np.array(matrix), np.array(target) - np.array(offset))


def input_at(system, barrier, k, x, excess):
    """The input that gives ψ_m(k) = excess."""
    at_zero, at_one = (psi(barrier, system, k, x, [[u]])[-1] for u in (0.0, 1.0))
    return np.array([(excess - at_zero) / (at_one - at_zero)])


@settings(max_examples=60, deadline=None)
@given(st.data(), st.integers(1, 3), st.integers(1, 5), st.integers(0, 2**32 - 1), st.sampled_from([1, -1]))
def test_any_input_with_psi_m_nonnegative_keeps_h_nonnegative(data, m, period, seed, sign):
    rng = np.random.default_rng(seed)
    system = chain(rng, m, period)
    alphas = data.draw(st.lists(class_k, min_size=m, max_size=m))
    bound = tabulated(rng.uniform(-1, 1, int(rng.integers(1, 6))))
    normals = rng.uniform(0.5, 1.5, (int(rng.integers(1, 4)), 1)) * np.eye(m)[0]
    barrier = AffineBarrier("x1", normals, bound, sign, alphas)
    check_relative_degree(barrier, system)
    x = start_with(system, barrier, data.draw(st.lists(unit, min_size=m, max_size=m)))
    excesses = data.draw(st.lists(st.one_of(st.just(0.0), unit), min_size=1, max_size=7))
    for k in range(CYCLES * period * barrier.period):
        assert barrier.h(k, x) >= -1e-9
        x = system.step(k, x, input_at(system, barrier, k, x, excesses[k % len(excesses)]))
    assert barrier.h(CYCLES * period * barrier.period, x) >= -1e-9


@pytest.mark.parametrize("m", [1, 2, 3])
def test_less_than_nonnegative_psi_m_is_not_enough(m):
    """The test above can fail: a ψ_m a little under zero, held, drives h under zero."""
    system = chain(np.random.default_rng(m), m, 2)
    barrier = AffineBarrier("x1", np.eye(m)[0], tabulated([1.0, 1.5, 0.5]), 1, [0.5] * m)
    x = start_with(system, barrier, [0.1] * m)
    h = []
    for k in range(60):
        x = system.step(k, x, input_at(system, barrier, k, x, -0.01))
        h.append(barrier.h(k + 1, x))
    assert min(h) < -0.005


@pytest.mark.parametrize("m", [2, 3])
def test_h_nonnegative_alone_is_not_membership(m):
    """h(0) ≥ 0 with ψ_1(0) < 0: ψ_m = 0 from then on lets h go negative, so membership has to ask for all ψ_i."""
    system = chain(np.random.default_rng(m), m, 2)
    barrier = AffineBarrier("x1", np.eye(m)[0], tabulated([1.0]), 1, [0.5] * m)
    x = start_with(system, barrier, [0.1, -1.0] + [0.0] * (m - 2))
    assert barrier.h(0, x) > 0
    assert not in_safe_set(barrier, system, 0, x)
    h = []
    for k in range(10):
        x = system.step(k, x, input_at(system, barrier, k, x, 0.0))
        h.append(barrier.h(k + 1, x))
    assert min(h) < -0.01


@given(st.lists(unit, min_size=5, max_size=30), st.lists(unit, min_size=2, max_size=2), class_k, class_k)
def test_theorem_on_sequences(excess, start, first, second):
    """Any sequence with ψ_2 ≥ 0 and ψ_0(0), ψ_1(0) ≥ 0 has h ≥ 0, and `psi_along` gives the ψ_2 back."""
    h, psi_1 = [start[0]], start[1]
    for value in excess:
        h.append(psi_1 + h[-1] - first(h[-1]))
        psi_1 = value + psi_1 - second(psi_1)
    assert min(h) >= 0
    assert psi_along(h, (first, second))[2] == pytest.approx(excess[: len(h) - 2], abs=1e-12)


@given(st.floats(0.05, 1.0), st.floats(-5.0, -0.1), st.integers(0, 2**32 - 1))
def test_outside_h_recovers_at_the_rate_of_gamma(gamma, h_start, seed):
    rng = np.random.default_rng(seed)
    system = chain(rng, 1, 3)
    barrier = AffineBarrier("x", [1.0], tabulated(rng.uniform(-1, 1, 4)), 1, (gamma,))
    x = start_with(system, barrier, [h_start])
    for k in range(40):
        assert barrier.h(k, x) >= (1 - gamma) ** k * h_start - 1e-9
        x = system.step(k, x, input_at(system, barrier, k, x, rng.uniform(0, 0.1) * (k % 2)))


def test_saturating_class_k_demands_a_bounded_recovery():
    """From h = −5 with γσ = 0.1: h rises by 0.1 a tick at most is asked for, and it does come back."""
    system = PeriodicAffineSystem([[1.0]], [[1.0]])
    barrier = AffineBarrier("x", [1.0], tabulated([0.0]), 1, (Saturating(0.5, 0.2),))
    x, h = np.array([5.0]), []
    for k in range(100):
        x = system.step(k, x, input_at(system, barrier, k, x, 0.0))
        h.append(barrier.h(k, x))
    assert np.max(np.diff(h)) <= 0.1 + 1e-12
    assert h[-1] == pytest.approx(0.0, abs=1e-6)


@given(st.floats(0.05, 1.0), st.floats(0.0, 0.5), st.floats(-1.0, 1.0), st.integers(0, 2**32 - 1))
def test_disturbed_h_stays_above_its_bound(gamma, d, h_start, seed):
    """|d(k)| ≤ d̄ on h: h(k) ≥ (1−γ)^k h(0) − d̄/γ."""
    rng = np.random.default_rng(seed)
    system = chain(rng, 1, 2)
    barrier = AffineBarrier("x", [1.0], tabulated(rng.uniform(-1, 1, 3)), 1, (gamma,))
    x = start_with(system, barrier, [h_start])
    for k in range(60):
        assert barrier.h(k, x) >= (1 - gamma) ** k * h_start - d / gamma - 1e-9
        x = system.step(k, x, input_at(system, barrier, k, x, 0.0)) + rng.uniform(-d, d)


def test_the_disturbance_bound_is_reached():
    gamma, d, h = 0.2, 0.1, 0.0
    for _ in range(200):
        h = (1 - gamma) * h - d
    assert h == pytest.approx(-d / gamma, abs=1e-9)


@settings(deadline=None)
@given(st.integers(1, 3), st.floats(0.05, 1.0), st.floats(0.0, 0.5), st.integers(0, 2**32 - 1))
def test_tightening_by_the_disturbance_restores_invariance(m, gamma, d, seed):
    """ψ_m ≥ d̄, the disturbance entering where the input does (on h(k+m)): h ≥ 0 again, for every m."""
    rng = np.random.default_rng(seed)
    system = chain(rng, m, 2)
    barrier = AffineBarrier("x1", np.eye(m)[0], tabulated(rng.uniform(-1, 1, 3)), 1, [gamma] * m)
    x = start_with(system, barrier, [0.1] * m)
    for k in range(40):
        u = input_at(system, barrier, k, x, d)
        x = system.step(k, x, u)
        reach = np.eye(m)[-1]  # of a disturbance on the state that the input drives
        for j in range(1, m):
            reach = system.A(k + j) @ reach
        x[-1] += rng.uniform(-d, d) / abs(reach[0])  # so that h(k+m) moves by at most d̄
        assert barrier.h(k + 1, x) >= -1e-9
