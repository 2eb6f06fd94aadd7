"""Periodic bounds and barriers, and their configurations."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.barriers import (
    AffineBarrier,
    Barrier,
    BarrierConfig,
    Bound,
    BoundConfig,
    Linear,
    Saturating,
    constant,
    harmonic,
    make_barrier,
    make_bound,
    tabulated,
)
from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError


def message(call):
    with pytest.raises(InputError) as caught:
        call()
    return str(caught.value)


def bound_of(orbit=None, side="upper", period=4, **keys):
    return make_bound(parse_config(BoundConfig, keys, "bound"), period, orbit, side)


@pytest.mark.parametrize("bound", [constant(0.3), harmonic(0.4, 0.1, -0.2, 7), tabulated([1.0, 2.0, 5.0])])
def test_bounds_repeat(bound):
    for k in range(-9, 25):
        assert bound(k) == bound(k + bound.period)
        assert np.array_equal(bound.samples(k, 11), [bound(k + i) for i in range(11)])


def test_harmonic_is_its_formula():
    bound = harmonic(0.4, 0.1, -0.2, 8)
    assert bound.period == 8
    for k in range(8):
        angle = 2 * np.pi * k / 8
        assert bound(k) == pytest.approx(0.4 + 0.1 * np.cos(angle) - 0.2 * np.sin(angle), abs=1e-15)


def test_bounds_of_an_orbit():
    orbit = [0.1, 0.4, 0.2, 0.0]
    assert bound_of(orbit, kind="orbit", margin=0.05).values == pytest.approx([0.15, 0.45, 0.25, 0.05])
    assert bound_of(orbit, "lower", kind="orbit", margin=0.05).values == pytest.approx([0.05, 0.35, 0.15, -0.05])
    assert bound_of(orbit, kind="orbit_peak", margin=0.05) == constant(0.45)
    assert bound_of(orbit, "lower", kind="orbit_peak", margin=0.05) == constant(-0.05)
    assert bound_of([1.0, 2.0], kind="orbit").values == (1.0, 2.0)
    assert bound_of(kind="constant", value=2) == constant(2.0)
    assert bound_of(kind="harmonic", mean=1.0, sine=0.5) == harmonic(1.0, 0.0, 0.5, 4)
    assert bound_of(kind="tabulated", values=[1.0, 2.0]) == tabulated([1.0, 2.0])


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: Bound(()), "a bound needs at least one value, given none"),
        (lambda: tabulated([1.0, np.nan]), "a bound must be finite at every tick, given nan at tick 1"),
        (lambda: constant(np.inf), "a bound must be finite at every tick, given inf at tick 0"),
        (lambda: tabulated(np.ones((2, 2))),
         "a tabulated bound is a list of numbers, one per tick, given shape (2, 2)"),
        (lambda: harmonic(0, 1, 0, 628.3),
         "the period of a bound is a whole number of ticks, at least 1 and at most 1000000, given 628.3"),
        (lambda: bound_of(kind="tabulated", values=[1.0, 2.0, 3.0]),
         "the tabulated bound has 3 values, but the period is 4 ticks: give a divisor of it"),
        (lambda: bound_of([1.0] * 8, kind="orbit"),
         "the nominal orbit has 8 values, but the period is 4 ticks: give a divisor of it"),
        (lambda: bound_of(kind="orbit"),
         'bound kind "orbit" needs the nominal orbit, which this system does not provide'),
        (lambda: bound_of(kind="constant"),
         'bound: a bound of kind "constant" needs value; it takes: value'),
        (lambda: bound_of(kind="orbit", value=1.0),
         'bound: a bound of kind "orbit" does not use value; it takes: margin'),
        (lambda: bound_of(kind="square"),
         "bound.kind: must be 'constant', 'harmonic', 'tabulated', 'orbit' or 'orbit_peak' (given: 'square')"),
    ],
)  # fmt: skip
def test_wrong_bounds_are_refused_in_one_sentence(call, text):
    assert message(call) == text


def barrier_config(**keys):
    return parse_config(BarrierConfig, {"bound": {"kind": "constant", "value": 0.5}, **keys}, "barriers.vx")


def test_barriers_of_a_configuration():
    barrier = make_barrier("vx", barrier_config(gamma=[0.5, 0.2], unit="m/s"), [0, 1, 0], constant(0.5))
    assert isinstance(barrier, AffineBarrier)
    assert (barrier.sign, barrier.order, barrier.relative_degree, barrier.unit) == (1, 2, 2, "m/s")
    assert barrier.class_k == (Linear(0.5), Linear(0.2))
    assert barrier.h(3, np.array([7.0, 0.2, 9.0])) == pytest.approx(0.3)
    lower = make_barrier("vx", barrier_config(side="lower", gamma=[0.5], relative_degree=2), [0, 1, 0], constant(0.5))
    assert (lower.sign, lower.order, lower.relative_degree) == (-1, 1, 2)
    assert lower.h(0, np.array([7.0, 0.2, 9.0])) == pytest.approx(-0.3)
    saturating = barrier_config(class_k="saturating", class_k_scale=0.1).make_class_k()
    assert saturating == (Saturating(0.5, 0.1),) * 2


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"gamma": [0.5, 5.0]},
         "barriers.vx.gamma: class-K rate gamma = 5.0 is outside (0, 1]: alpha(s) = gamma*s must rise, and not above s "
         "(given: [0.5, 5.0])"),
        ({"gamma": 0.5}, "barriers.vx.gamma: must be a list (given: 0.5)"),
        ({"gama": [0.5]},
         "barriers.vx.gama: unknown key; allowed here: bound, class_k, class_k_scale, gamma, relative_degree, side, "
         "unit"),
        ({"relative_degree": 0}, "barriers.vx.relative_degree: must be at least 1 (given: 0)"),
    ],
)  # fmt: skip
def test_wrong_barrier_configs_are_refused_in_one_sentence(keys, text):
    assert message(lambda: barrier_config(**keys)) == text


def test_the_normal_of_an_affine_barrier_may_vary_with_the_tick():
    normals = np.array([[1.0, 0.0], [1.0, 0.5], [0.0, 2.0]])
    barrier = AffineBarrier("b", normals, tabulated([1.0, 2.0]), 1, (0.5,))
    assert barrier.period == 6
    assert np.array_equal(barrier.normals(-1, 5), normals[[2, 0, 1, 2, 0]])
    for k in range(12):
        assert barrier.h(k, np.array([3.0, 4.0])) == pytest.approx(barrier.bound(k) - normals[k % 3] @ [3.0, 4.0])


def test_a_constant_normal_is_a_vector_however_it_is_given():
    for normal in ([0.0, 1.0], [[0.0, 1.0]], [[0.0, 1.0]] * 3):
        barrier = AffineBarrier("b", normal, constant(1), 1, (0.5,))
        assert np.array_equal(barrier.normals(5, 2), [[0.0, 1.0]] * 2)
    assert AffineBarrier("b", [[0.0, 1.0]], constant(1), 1, (0.5,)).normal.shape == (2,)


def test_nan_and_a_missing_scale_are_refused():
    assert "barriers.vx.gamma.0: must be a finite number" in message(lambda: barrier_config(gamma=[float("nan")]))
    assert 'class_k "saturating" needs class_k_scale' in message(lambda: barrier_config(class_k="saturating"))
    assert 'class_k "linear" does not use class_k_scale' in message(lambda: barrier_config(class_k_scale=1.0))


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: Barrier("b", lambda k, x: 0, 0, (0.5,)),
         'barrier "b": the period is a whole number of ticks, at least 1, given 0'),
        (lambda: Barrier("b", lambda k, x: 0, 1, ()),
         'barrier "b": at least one class-K function is needed, given none'),
        (lambda: Barrier("b", lambda k, x: 0, 1, (0.5, 0.5), relative_degree=1),
         'barrier "b": 2 class-K functions are given for a declared relative degree of 1, but at most that many are '
         "allowed (else psi_i holds inputs for some i < m)"),
        (lambda: AffineBarrier("b", [0.0, 0.0], constant(1), 1, (0.5,)),
         'barrier "b": the normal must be a vector other than zero, given [0.0, 0.0]'),
        (lambda: AffineBarrier("b", [[1.0], [0.0]], constant(1), 1, (0.5,)),
         'barrier "b": the normal must be a vector other than zero, given [[1.0], [0.0]]'),
        (lambda: AffineBarrier("b", 1.0, constant(1), 1, (0.5,)),
         'barrier "b": the normal must be a vector other than zero, given 1.0'),
        (lambda: AffineBarrier("b", [1.0, 0.0], constant(1), 2, (0.5,)),
         'barrier "b": the sign is +1 (upper bound) or -1 (lower bound), given 2'),
    ],
)  # fmt: skip
def test_wrong_barriers_are_refused_in_one_sentence(call, text):
    assert message(call) == text
