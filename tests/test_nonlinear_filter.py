"""The nonlinear filter against closed forms, the affine filter and a fine grid; and a point among moving obstacles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.barriers import (
    AffineBarrier,
    Barrier,
    BarrierFilter,
    NonlinearFilter,
    PeriodicAffineSystem,
    constant,
    psi,
    record,
)
from pdhocbf_drake.errors import InputError

TICK, PERIOD = 0.1, 40
PLANE = PeriodicAffineSystem(np.eye(2), TICK * np.eye(2))


def plane(input_unit=1.0, length_unit=1.0):
    return PeriodicAffineSystem(np.eye(2), TICK * np.eye(2) * length_unit / input_unit)


def disc(centre, radius, gamma=0.3, name="disc", period=PERIOD):
    """Outside a disc whose centre is a function of the tick."""
    return Barrier(name, lambda k, x: (x - centre(k)) @ (x - centre(k)) - radius**2, period, [gamma])


def swinging(k):
    angle = 2 * np.pi * k / PERIOD
    return np.array([1.0 + 0.5 * np.cos(angle), 0.3 * np.sin(angle)])


AROUND = NonlinearFilter(PLANE, [disc(swinging, 0.5)])


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_nearest_velocity_outside_a_moving_disc_is_the_projection_onto_it(seed):
    """ψ_1 ≥ 0 says ‖x + δu − c(k+1)‖² ≥ r² + (1 − γ) h(k, x): the answer lies on the ray from the centre."""
    rng = np.random.default_rng(seed)
    k, x, wanted = int(rng.integers(0, 2 * PERIOD)), rng.uniform(-1, 2.5, 2), rng.uniform(-9, 9, 2)
    (barrier,) = AROUND.barriers
    result = AROUND(k, x, wanted)
    needed, offset = 0.5**2 + 0.7 * barrier.h(k, x), x + TICK * wanted - swinging(k + 1)
    assert result.status == "solved"
    assert result.psi[0] == pytest.approx(psi(barrier, PLANE, k, x, result.input)[-1], abs=1e-12)
    if offset @ offset >= needed:
        assert np.array_equal(result.input, wanted)
    else:
        projection = swinging(k + 1) + offset * np.sqrt(needed) / np.linalg.norm(offset)
        assert result.input == pytest.approx((projection - x) / TICK, rel=1e-6, abs=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 4))
def test_where_psi_is_affine_it_agrees_with_the_affine_filter(seed, inputs, count):
    rng = np.random.default_rng(seed)
    system = PeriodicAffineSystem(rng.normal(size=(3, 3)), rng.normal(size=(3, inputs)))
    barriers = [AffineBarrier(f"b{i}", rng.normal(size=3), constant(1.0), 1, [0.4]) for i in range(count)]
    x, wanted, limits = 0.3 * rng.normal(size=3), 3 * rng.normal(size=inputs), np.full(inputs, 2.0)
    nearest = BarrierFilter(system, barriers, -limits, limits)(0, x, wanted)
    found = NonlinearFilter(system, barriers, -limits, limits)(0, x, wanted)
    assert found.status == nearest.status
    if found.status == "solved":
        assert found.input == pytest.approx(nearest.input, rel=1e-6, abs=1e-6)
    else:
        assert found.slack == pytest.approx(nearest.slack, rel=1e-6, abs=1e-6)


def crowd(seed, input_unit=1.0, length_unit=1.0):
    """One to three curved barriers of different kinds, a state and a wanted velocity."""
    rng = np.random.default_rng(seed)
    barriers = []
    for i in range(rng.integers(1, 4)):
        centre, radius = rng.uniform(-0.3, 0.3, 2) * length_unit, rng.uniform(0.03, 0.2) * length_unit
        kinds = (
            lambda k, x, c=centre, r=radius: (x - c) @ (x - c) - r**2,  # outside a disc
            lambda k, x, c=centre, r=radius: (2 * r) ** 2 - (x - c) @ (x - c),  # inside a larger one
            lambda k, x, c=centre, r=radius: ((x[0] - c[0]) / r) ** 2 - ((x[1] - c[1]) / r) ** 2 + 0.2,  # a saddle
        )
        barriers.append(Barrier(f"b{i}", kinds[rng.integers(0, 3)], 1, [0.8]))
    x, wanted = rng.uniform(-0.3, 0.3, 2) * length_unit, rng.uniform(-1.5, 1.5, 2) * input_unit
    limits = np.full(2, input_unit)
    return NonlinearFilter(plane(input_unit, length_unit), barriers, -limits, limits), x, wanted


@pytest.mark.parametrize("seed", range(60))
def test_no_safe_input_of_a_grid_is_missed(seed):
    keep, x, wanted = crowd(seed)
    result = keep(0, x, wanted)
    axis = np.linspace(-1.0, 1.0, 61)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    least = np.min([[b.h(1, x + TICK * u) - 0.2 * b.h(0, x) for u in grid] for b in keep.barriers], axis=0)
    safe = grid[least >= 0]
    assert np.all(np.abs(result.input) <= 1.0)
    again = [psi(barrier, keep.system, 0, x, result.input)[-1] for barrier in keep.barriers]
    assert result.psi == pytest.approx(again, rel=1e-9, abs=1e-12)
    if len(safe):
        assert result.status == "solved"
        nearest = np.linalg.norm(safe - wanted, axis=1).min()
        assert np.linalg.norm(result.input - wanted) < nearest + 0.05
    if result.status == "solved":
        assert np.all(result.psi >= -1e-9)
        assert not np.any(result.slack)
    else:
        assert result.status == "softened"
        assert result.reason == "no input was found that satisfies every barrier at once"
        assert np.any(result.slack > 0)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize(("input_unit", "length_unit"), [(1e-9, 1.0), (1e9, 1.0), (1.0, 1e-9), (1.0, 1e9), (1e6, 1e-3)])
def test_units_do_not_matter(seed, input_unit, length_unit):
    keep, x, wanted = crowd(seed)
    expected = keep(0, x, wanted)
    keep, x, wanted = crowd(seed, input_unit, length_unit)
    found = keep(0, x, wanted)
    assert found.status == expected.status
    assert found.input / input_unit == pytest.approx(expected.input, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_from_the_centre_of_a_disc_where_no_slope_shows_the_way_out(unit):
    still = Barrier("disc", lambda k, x: x @ x - unit**2, 1, [0.5])
    result = NonlinearFilter(PLANE, [still])(0, [0.0, 0.0], [0.0, 0.0])
    assert result.status == "solved"
    assert np.linalg.norm(TICK * result.input) == pytest.approx(unit * np.sqrt(0.5), rel=1e-6)


def test_the_barrier_of_higher_priority_is_kept_and_the_other_missed_by_as_little():
    """Outside a disc of radius 2 and inside one of radius 1 around the same centre: one of them alone can be kept."""
    outside = Barrier("outside", lambda k, x: x @ x - 4.0, 1, [1.0])
    inside = Barrier("inside", lambda k, x: 1.0 - x @ x, 1, [1.0])
    for priority, radius in ((["outside"], 2.0), (["inside"], 1.0)):
        keep = NonlinearFilter(PLANE, [inside, outside], priority=priority)
        result = keep(0, [1.5, 0.0], [1.0, 2.0])
        assert result.status == "softened"
        assert np.linalg.norm([1.5, 0.0] + TICK * result.input) == pytest.approx(radius, abs=1e-6)
        kept = 1 if priority == ["outside"] else 0
        assert result.slack[kept] == 0
        assert result.slack[1 - kept] == pytest.approx(3.0, rel=1e-6)


class Clipping:
    """x⁺ = x + δ·clip(u, −5, 5)."""

    period, n, m = 1, 1, 1

    def step(self, k, x, u):
        return x + TICK * np.clip(u, -5.0, 5.0)


def test_dynamics_that_clip_their_input():
    """From 1.2 under x ≤ 1 with γ = 1 the input must be at most −2; the wanted 10 is clipped by the dynamics."""
    below = Barrier("x", lambda k, x: 1.0 - x[0], 1, [1.0])
    result = NonlinearFilter(Clipping(), [below], [-10.0], [10.0])(0, [1.2], [10.0])
    assert (result.status, result.input) == ("solved", pytest.approx([-2.0], abs=1e-6))


def test_tightening_is_kept_on_top():
    keep = NonlinearFilter(PLANE, [disc(swinging, 0.5)], tightening=0.05)
    result = keep(0, [0.8, 0.0], [9.0, 0.1])
    assert result.status == "solved"
    assert result.psi[0] == pytest.approx(0.05, abs=1e-9)


def test_numbers_that_are_not_finite_fail_in_a_defined_way():
    keep = NonlinearFilter(PLANE, [disc(swinging, 0.5)], upper=[1.0, 1.0])
    for x, wanted in (([np.nan, 0.0], [2.0, 0.0]), ([0.0, 0.0], [np.inf, 0.0])):
        result = keep(0, x, wanted)
        assert result.status == "failed"
        assert result.reason == "the state or the wanted input is not finite"
        assert np.all(result.input <= 1.0)


def test_it_checks_what_it_is_given():
    with pytest.raises(
        InputError, match="relative degree 2 is declared by 2 class-K functions, but the dynamics give 1"
    ):
        NonlinearFilter(PLANE, [Barrier("d", lambda k, x: x @ x - 1.0, 1, [0.5, 0.5])])
    with pytest.raises(InputError, match="the priority is a list of different names among disc, given"):
        NonlinearFilter(PLANE, [disc(swinging, 0.5)], priority=["disk"])


def cart():
    eye, nothing = np.eye(2), np.zeros((2, 2))
    return PeriodicAffineSystem(np.block([[eye, TICK * eye], [nothing, eye]]), np.vstack([nothing, TICK * eye]))


def test_a_cart_stays_outside_two_moving_discs_for_a_minute():
    """Relative degree 2, limits on the acceleration, and a wanted one that goes through both discs again and again."""

    def round_disc(name, middle, phase):
        def h(k, x):
            angle = 2 * np.pi * k / 80 + phase
            offset = x[:2] - np.array(middle) - 0.5 * np.array([np.sin(angle), np.cos(angle)])
            return offset @ offset - 0.4**2

        return Barrier(name, h, 80, [0.2, 0.2], "m²")

    barriers = [round_disc("first", [1.5, 0.3], 0.0), round_disc("second", [3.0, -0.3], 2.0)]
    keep = NonlinearFilter(cart(), barriers, lower=[-4.0, -4.0], upper=[4.0, 4.0])
    states, free = [np.zeros(4)], [np.zeros(4)]
    for k in range(600):
        goal = np.array([4.5, 0.0]) * (k // 120 % 2 == 0)
        wanted = [np.clip((goal - x[:2]) - 1.6 * x[2:], -1.5, 1.5) for x in (states[-1], free[-1])]
        result = keep(k, states[-1], wanted[0])
        assert result.status == "solved"
        states.append(cart().step(k, states[-1], result.input))
        free.append(cart().step(k, free[-1], wanted[1]))
    for barrier in barriers:
        assert record(barrier, states).h_min > -1e-9
        assert record(barrier, free).violations > 0
    assert max(x[0] for x in states) > 4.0  # it gets past both of them


@pytest.mark.parametrize(("aside", "passes"), [(0.0, False), (0.001, True)])
def test_a_barrier_stops_in_front_of_the_obstacle_or_passes_it(aside, passes):
    """A wanted velocity straight at a standing disc has no part along its edge; from a millimetre aside it has one."""
    still = disc(lambda k: np.array([1.5, 0.0]), 0.5, period=1)
    keep, x, goal = (
        NonlinearFilter(PLANE, [still], [-1.5, -1.5], [1.5, 1.5]),
        np.array([0.0, aside]),
        np.array([3.0, 0.0]),
    )
    for k in range(250):
        result = keep(k, x, (goal - x) / max(1.0, float(np.linalg.norm(goal - x))))
        assert result.status == "solved"
        x = PLANE.step(k, x, result.input)
    assert np.linalg.norm(x - (goal if passes else [1.0, 0.0])) < 1e-3
