"""The ψ recursion against formulas expanded by hand, and against its own inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdhocbf_drake.barriers import (
    AffineBarrier,
    Barrier,
    Linear,
    PeriodicAffineSystem,
    Saturating,
    psi,
    psi_along,
    psi_coefficients,
    psi_from_h,
    tabulated,
)

rates = st.floats(0.01, 1.0)
values = st.floats(-10.0, 10.0)


@given(rates, rates, rates, st.lists(values, min_size=4, max_size=4))
def test_linear_recursion_is_the_expanded_formula(g1, g2, g3, h):
    h0, h1, h2, h3 = h
    alphas = [Linear(g1), Linear(g2), Linear(g3)]
    found = psi_from_h(h, alphas)
    assert found[0] == h0
    assert found[1] == pytest.approx(h1 - (1 - g1) * h0, abs=1e-12)
    assert found[2] == pytest.approx(h2 - (2 - g1 - g2) * h1 + (1 - g1) * (1 - g2) * h0, abs=1e-12)
    a, b, c = 1 - g1, 1 - g2, 1 - g3
    expanded = h3 - (a + b + c) * h2 + (a * b + b * c + c * a) * h1 - a * b * c * h0
    assert found[3] == pytest.approx(expanded, abs=1e-12)
    for m in (1, 2, 3):
        coefficients = psi_coefficients([g1, g2, g3][:m])
        assert found[m] == pytest.approx(coefficients @ np.array(h[: m + 1]), abs=1e-12)


@given(st.lists(values, min_size=3, max_size=3))
def test_nonlinear_recursion_is_the_expanded_formula(h):
    h0, h1, h2 = h
    first, second = Saturating(0.6, 0.5), Saturating(0.3, 2.0)

    def alpha(gamma, scale, s):
        return gamma * scale * np.tanh(s / scale)

    psi_1 = h1 - h0 + alpha(0.6, 0.5, h0)
    psi_1_next = h2 - h1 + alpha(0.6, 0.5, h1)
    psi_2 = psi_1_next - psi_1 + alpha(0.3, 2.0, psi_1)
    assert psi_from_h(h, [first, second]) == pytest.approx([h0, psi_1, psi_2], abs=1e-12)


@given(st.lists(values, min_size=3, max_size=9), st.lists(rates, min_size=1, max_size=3))
def test_psi_along_a_log_is_the_recursion_at_each_tick(h, gammas):
    alphas = [Linear(g) for g in gammas]
    levels = psi_along(h, alphas)
    assert [len(level) for level in levels] == [max(len(h) - i, 0) for i in range(len(gammas) + 1)]
    for k in range(len(h)):
        here = psi_from_h(h[k : k + len(gammas) + 1], alphas)
        assert here == pytest.approx([level[k] for level in levels if k < len(level)], abs=1e-12)


def test_the_bound_moves_with_the_tick():
    """A state that stands still under a bound that falls by 0.1 a tick: h(k+1) is taken with V̄(k+1)."""
    still = PeriodicAffineSystem(np.eye(1), np.zeros((1, 1)))
    barrier = AffineBarrier("x", [1.0], tabulated([1.0, 0.9, 0.8, 0.7]), 1, (0.5,))
    assert psi(barrier, still, 1, [0.2], []) == pytest.approx([0.7, (0.8 - 0.2) - 0.5 * 0.7])
    # ... and at the end of the period the bound is that of its start again
    assert psi(barrier, still, 3, [0.2], []) == pytest.approx([0.5, (1.0 - 0.2) - 0.5 * 0.5])
    assert psi(barrier, still, 4 * 7 + 1, [0.2], []) == pytest.approx(psi(barrier, still, 1, [0.2], []))


def test_lower_barrier_mirrors_the_upper_one():
    system = PeriodicAffineSystem([[1.0, 0.1], [-0.2, 0.9]], [[0.0], [0.1]])
    upper = AffineBarrier("up", [1.0, 0.3], tabulated([1.0, 1.2]), 1, (0.5, 0.4))
    lower = AffineBarrier("low", [1.0, 0.3], tabulated([-1.0, -1.2]), -1, (0.5, 0.4))
    x, u = np.array([0.3, -0.7]), np.array([[0.4], [0.1]])
    assert psi(lower, system, 1, -x, -u) == pytest.approx(psi(upper, system, 1, x, u), abs=1e-14)


def test_psi_simulates_the_dynamics_from_its_own_tick():
    """Everything by hand on a system and a barrier of different periods, 2 and 3."""
    gain = [1.0, -0.5]
    system = PeriodicAffineSystem(np.array([[[g]] for g in gain]), [[2.0]], [0.1])
    barrier = Barrier("h", lambda k, x: (k % 3 + 1.0) - x[0] ** 2, 3, (0.25, 0.75))
    k, x, u = 5, 0.3, (0.2, -0.4)
    x1 = gain[1] * x + 2.0 * u[0] + 0.1
    x2 = gain[0] * x1 + 2.0 * u[1] + 0.1
    h0, h1, h2 = (3.0 - x**2), (1.0 - x1**2), (2.0 - x2**2)
    expected = [h0, h1 - 0.75 * h0, h2 - (0.75 + 0.25) * h1 + 0.75 * 0.25 * h0]
    assert psi(barrier, system, k, [x], [[u[0]], [u[1]]]) == pytest.approx(expected, abs=1e-14)
