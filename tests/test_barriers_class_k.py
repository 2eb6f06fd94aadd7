"""Class-K functions: those that are refused, and the invariance that they would break."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pdhocbf_drake.barriers import Barrier, Linear, Saturating, check_class_k
from pdhocbf_drake.errors import InputError


def message(call):
    with pytest.raises(InputError) as caught:
        call()
    return str(caught.value)


def test_twice_s_is_refused_and_would_break_invariance():
    # Lemma 1 as printed: b(k+1) − b(k) ≥ −α(b(k)) and b(0) ≥ 0. With α(s) = 2s it allows b(1) = −b(0).
    def alpha(s):
        return 2.0 * s

    b = [1.0]
    b.append(-b[0])
    assert b[1] - b[0] >= -alpha(b[0])
    assert b[1] < 0
    assert message(lambda: Barrier("h", lambda k, x: x[0], 1, (alpha,))) == (
        'barrier "h", class-K function 1: alpha(1e-09) = 2e-09 is above s, but alpha(s) <= s is needed for s >= 0: '
        "otherwise psi >= 0 does not keep h >= 0"
    )
    assert message(lambda: Linear(2.0)) == (
        "class-K rate gamma = 2.0 is outside (0, 1]: alpha(s) = gamma*s must rise, and not above s"
    )


@pytest.mark.parametrize("gamma", [0.0, -0.5, 1.0001, np.nan, np.inf, np.int64(2)])
def test_rates_outside_are_refused(gamma):
    assert f"gamma = {gamma} is outside (0, 1]" in message(lambda: Linear(gamma))
    assert f"gamma = {gamma} is outside (0, 1]" in message(lambda: Saturating(gamma, 1.0))


@pytest.mark.parametrize("gamma", ["0.5", None, True, [0.5]])
def test_rates_that_are_no_numbers_are_refused(gamma):
    assert message(lambda: Linear(gamma)) == f"class-K rate gamma must be a number in (0, 1], given {gamma!r}"


def test_whole_numbers_of_numpy_are_rates():
    assert Linear(np.int64(1))(0.3) == 0.3


@pytest.mark.parametrize("scale", [0.0, -1.0])
def test_scales_outside_are_refused(scale):
    assert message(lambda: Saturating(0.5, scale)) == f"class-K scale = {scale} must be positive"


@pytest.mark.parametrize("scale", [np.nan, np.inf, "a", True])
def test_scales_that_are_not_finite_are_refused(scale):
    assert message(lambda: Saturating(0.5, scale)) == f"class-K scale must be a finite number, given {scale!r}"


@pytest.mark.parametrize(
    ("alpha", "why"),
    [
        (lambda s: 0.5 * s + 0.1, "alpha(0) = 0.1, but a class-K function is 0 at 0"),
        (lambda s: -0.5 * s, "alpha is not increasing"),
        (lambda s: max(s, 0.0) * 0.5, "alpha is not increasing"),
        (lambda s: min(s, 0.0) * 0.5, "alpha is not increasing"),
        (lambda s: abs(s) * 0.5, "alpha is not increasing"),
        (lambda s: 1.001 * s, "alpha(s) <= s is needed"),
        (lambda s: s**3, "alpha(s) <= s is needed"),  # fine up to 1, above s from there on
        (lambda s: np.sign(s) * abs(s) ** 0.5, "alpha(s) <= s is needed"),  # fine from 1 on
        (lambda s: np.nan * s if s else 0.0, "alpha is not increasing"),
    ],
)
def test_functions_that_are_not_class_k_are_refused(alpha, why):
    assert why in message(lambda: check_class_k(alpha, "here"))


def test_a_user_function_is_accepted():
    def alpha(s):
        return 0.5 * s / (1 + abs(s))

    check_class_k(alpha, "here")
    assert Barrier("h", lambda k, x: x[0], 1, (alpha, 0.3)).class_k == (alpha, Linear(0.3))


@given(st.floats(0.01, 1.0), st.floats(0.01, 10.0), st.floats(1e-9, 1e3), st.floats(1e-9, 1e3))
def test_saturating_is_class_k(gamma, scale, s, t):
    alpha = Saturating(gamma, scale)
    assert alpha(0.0) == 0
    assert alpha(-s) == -alpha(s)
    assert alpha(s) <= gamma * s * (1 + 1e-12)
    assert alpha(s) <= gamma * scale
    assert alpha(min(s, t)) <= alpha(max(s, t))
    # trying it like a stranger's function agrees with knowing it
    check_class_k(lambda v: alpha(v), "here")
