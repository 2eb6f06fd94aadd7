"""The plan of a walk over known ground: footsteps on treads, the line under the CoM, swings that clear edges, eta."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake import InputError
from pdhocbf_drake.ground.config import Blocks, Slope, Stairs
from pdhocbf_drake.ground.terrain import Terrain
from pdhocbf_drake.walking import Gait, GaitConfig
from pdhocbf_drake.walking.com_line import ComLine
from pdhocbf_drake.walking.edges import Edges
from pdhocbf_drake.walking.known_ground import CLEARANCE, ROOM, KnownGround
from pdhocbf_drake.walking.swing import Swing
from pdhocbf_drake.walking.swing_profile import SwingProfile, Timing, change_of_ground
from pdhocbf_drake.walking.uneven_eta import UnevenEta
from pdhocbf_drake.walking.uneven_footsteps import uneven_footsteps

HALF = 0.108
PERIOD, TICK = 40, 0.01


def gait_over(*pieces: Blocks | Stairs | Slope, **keys: float) -> Gait:
    config = GaitConfig.model_validate({"stride": 0.15, **keys})
    return Gait(config, uneven_footsteps(config, KnownGround(Terrain(pieces), HALF)))


STAIRS = Stairs(at=1.0, rise=0.05, tread=0.25, count=4)


# Footsteps.


@settings(max_examples=25, deadline=None)
@given(
    st.floats(0.5, 2.0), st.floats(-0.1, 0.1).filter(lambda r: abs(r) > 0.01), st.floats(0.23, 0.35), st.integers(1, 9)
)
def test_one_foot_stands_in_the_middle_of_each_tread_and_none_on_an_edge(
    at: float, rise: float, tread: float, count: int
) -> None:
    gait = gait_over(Stairs(at=at, rise=rise, tread=tread, count=count), stride=0.2)
    steps = [gait.step(j) for j in range(2, len(gait.footsteps.listed) - 1)]
    edges = at + tread * np.arange(count)
    for step in steps:
        assert min(abs(edges - step.x)) >= HALF
        assert step.height == pytest.approx(rise * sum(edges < step.x))
        assert step.window[0] <= step.x <= step.window[1]
    on_treads = [step.x for step in steps if at < step.x < edges[-1]]
    np.testing.assert_allclose(on_treads, edges[:-1] + tread / 2.0)
    assert [step.side for step in steps] == [steps[0].side * (-1) ** i for i in range(len(steps))]
    assert max(np.diff([step.x for step in steps])) <= max(0.2, tread + 0.05)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.lists(st.sampled_from([-0.03, 0.0, 0.02]), min_size=1, max_size=4), min_size=1, max_size=2),
    st.sampled_from([1, -1]),
)
def test_one_foot_stands_on_each_block_of_every_piece_be_it_on_a_level_with_the_ground_or_not(
    heights: list[list[float]], first: int
) -> None:
    blocks = [
        [(1.0 + 3.0 * i + 0.2 * k, 0.08 * first * (-1) ** k, z) for k, z in enumerate(piece)]
        for i, piece in enumerate(heights)
    ]
    gait = gait_over(*(Blocks(footsteps=tuple(piece)) for piece in blocks))
    steps = [gait.step(j) for j in range(2, len(gait.footsteps.listed))]
    for piece in blocks:
        inside = [step for step in steps if piece[0][0] - 0.1 <= step.x <= piece[-1][0] + 0.1]
        np.testing.assert_allclose([(s.x, s.y, s.height) for s in inside], piece, atol=1e-9)
    assert all(step.window[0] <= step.x <= step.window[1] for step in steps)
    assert 0.0 < min(np.diff([step.x for step in steps])) < max(np.diff([step.x for step in steps])) <= 0.25


def test_a_tread_as_long_as_soles_need_is_walked_on() -> None:
    gait = gait_over(Stairs(at=1.0, rise=0.05, tread=2.0 * (HALF + ROOM), count=3))
    assert [gait.step(j).x for j in range(2, 20)].count(pytest.approx(1.11)) == 1


def test_treads_shorter_than_the_soles_are_refused() -> None:
    with pytest.raises(
        InputError,
        match=r"^ground: the surface from x = 1 m on is 0\.2 m long, and soles need 0\.22 m$",
    ):
        gait_over(Stairs(at=1.0, rise=0.05, tread=0.2, count=3))


# The line under the CoM.


def test_over_a_constant_rise_the_line_is_straight_and_meets_each_stance_at_its_mid_step() -> None:
    line, rise = ComLine(PERIOD, TICK), 0.07
    planes = np.array([[h, 0.0, 0.0] for h in (-rise, 0.0, rise)])
    found = np.array([line(q, planes, *np.zeros((3, 2))) for q in range(PERIOD)])
    np.testing.assert_allclose(found[:, 0], rise * (np.arange(PERIOD) / PERIOD - 0.5), atol=1e-12)
    np.testing.assert_allclose(found[:, 1], rise / (PERIOD * TICK), atol=1e-12)
    np.testing.assert_allclose(found[:, 2], 0.0, atol=1e-9)


@given(st.integers(0, PERIOD - 1), st.integers(0, 2**32 - 1))
def test_on_a_plane_the_line_is_the_plane(phase: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    height, slope, (com, velocity, acceleration) = random.normal(), random.normal(size=2), random.normal(size=(3, 2))
    found = ComLine(PERIOD, TICK)(phase, np.tile([height, *slope], (3, 1)), com, velocity, acceleration)
    np.testing.assert_allclose(found, [height + slope @ com, slope @ velocity, slope @ acceleration], atol=1e-9)


def test_the_line_is_continuous_and_its_derivatives_are_those() -> None:
    line, heights = ComLine(PERIOD, TICK), [0.0, 0.0, 0.05, 0.02, 0.02, -0.04, -0.04]
    found = []
    for step in range(1, len(heights) - 1):
        planes = np.array([[h, 0.0, 0.0] for h in heights[step - 1 : step + 2]])
        found += [line(q, planes, *np.zeros((3, 2))) for q in range(PERIOD)]
    z, rate, _ = np.array(found).T
    np.testing.assert_allclose(np.diff(z) / TICK, 0.5 * (rate[1:] + rate[:-1]), atol=2e-3)


# Swings.


@given(st.floats(0.2, 0.5), st.floats(0.01, 0.99))
def test_a_clearance_with_ramps_is_smooth_starts_and_ends_at_rest_and_reaches_its_apex(ramp: float, s: float) -> None:
    lift, step = SwingProfile(apex=0.06, ramp=ramp), 1e-5
    (z0, *_), (_, v, a), (z1, *_) = (lift.clearance(s + d) for d in (-step, 0.0, step))
    middle = lift.clearance(s)[0]
    assert (z1 - z0) / (2 * step) == pytest.approx(v, abs=1e-4)
    assert (z1 - 2 * middle + z0) / step**2 == pytest.approx(a, abs=0.1 + 2e-2 * abs(a))
    assert lift.clearance(0.0) == lift.clearance(1.0) == (0.0, 0.0, 0.0)
    assert lift.clearance(0.5)[0] == pytest.approx(0.06)


@pytest.mark.parametrize("ticks", [40, 60])
@pytest.mark.parametrize(("rise", "tread"), [(0.03, 0.25), (0.08, 0.25), (0.12, 0.26), (-0.05, 0.25), (-0.08, 0.30)])
def test_the_swings_over_stairs_clear_every_edge(rise: float, tread: float, ticks: int) -> None:
    gait = gait_over(Stairs(at=1.0, rise=rise, tread=tread, count=3), ticks_per_step=ticks)
    ground = gait.footsteps.known_ground
    assert ground is not None
    timing, level = Timing(gait.swing_ticks(), TICK), gait.profiles(0)[0]
    for j in range(2, 16):
        start, end = ((gait.step(i).x, gait.step(i).y) for i in (j - 1, j + 1))
        assert ground.clearance(gait.profiles(j)[0], timing, start, end) >= CLEARANCE
    assert level == SwingProfile(apex=gait.config.swing_height) == gait.profiles(15)[0]


def test_a_sole_is_as_far_from_an_edge_as_the_nearest_of_its_points() -> None:
    up = Edges(np.array([1.0]), np.array([0.05]), np.array([1.0]))
    places = [(0.8, 0.0, 0.1), (0.89, 0.05, 0.01), (0.95, 0.07, 0.02), (0.87, 0.09, 0.05), (0.95, 0.03, -0.02)]
    for x, z, expected in places:
        assert up.least_distance(np.array([x]), np.array([z]), 0.1) == pytest.approx(expected)
    assert up.least_distance(np.array([1.11]), np.array([0.05]), 0.1) == math.inf  # it stands beyond the edge


def test_the_forecast_of_a_swing_is_the_swing_of_the_reference() -> None:
    """Both are that of the profile: what the foot then does is what the ZMP was expected to be shifted by."""
    gait = gait_over(STAIRS)
    swing, step = Swing(gait), 9
    assert gait.profiles(step)[0].wait > 0
    side, foot = gait.support(step), 1 if gait.support(step) > 0 else 0
    plan = np.zeros((2, 2, 2))
    for i, j in enumerate((step - 1, step + 1)):
        plan[foot, i] = gait.foothold(j)
    plan[1 - foot] = gait.foothold(step)
    profiles, sides = gait.profiles(step), np.repeat([float(gait.support(step + i)) for i in range(3)], PERIOD)
    expected, feet, moved = np.zeros((2, 2 * PERIOD)), np.zeros(18), []
    now, after = np.zeros((2, 3, 3)), gait.foothold(step + 2)
    swing.add_accelerations(0, sides[1 : 1 + 2 * PERIOD], now, plan, after, (1.0, 1.0), 1e9, expected, profiles)
    for q in range(PERIOD):
        feet = swing.feet(q, side, plan.ravel(), feet, gait.lift_off(step), profiles[0])
        moved.append(feet.reshape(2, 3, 3)[foot, 2, :2].copy())
    np.testing.assert_allclose(np.array(moved[1:]), expected[:, : PERIOD - 1].T, atol=1e-6)


def test_soles_on_the_ground_have_the_derivatives_of_their_motion() -> None:
    gait = gait_over(
        Slope(at=0.4, length=0.6, angle_deg=6.0, roll_deg=3.0), Stairs(at=1.3, rise=-0.05, tread=0.26, count=1)
    )
    swing = Swing(gait)
    for step in range(2, 12):
        foot, side = (1 if gait.support(step) > 0 else 0), gait.support(step)
        plan = np.zeros((2, 2, 2))
        plan[foot], plan[1 - foot] = [gait.foothold(j) for j in (step - 1, step + 1)], gait.foothold(step)
        feet, way, profile = np.zeros(18), [], gait.profiles(step)[0]
        for q in range(PERIOD + 1):
            feet = swing.feet(q, side, plan.ravel(), feet, gait.lift_off(step), profile)
            on_ground = feet.copy()
            swing.put_on_ground(q, side, gait.planes(step), on_ground, gait.lift_off(step), profile)
            way.append(on_ground.reshape(2, 3, 3)[foot, :, 2])
        z, rate, acceleration = np.array(way).T
        assert z[0] == pytest.approx(gait.step(step - 1).height)
        assert z[-1] == pytest.approx(gait.step(step + 1).height)
        np.testing.assert_allclose(np.diff(z) / TICK, 0.5 * (rate[1:] + rate[:-1]), atol=0.05)
        np.testing.assert_allclose(np.diff(rate) / TICK, 0.5 * (acceleration[1:] + acceleration[:-1]), atol=3.0)


def test_the_change_of_ground_goes_from_one_foothold_to_the_next() -> None:
    assert change_of_ground((0.2, 0.7), 0.36, 0.2 * 0.36) == (0.0, 0.0, 0.0)
    assert change_of_ground((0.2, 0.7), 0.36, 0.7 * 0.36)[0] == pytest.approx(1.0)


# eta of an even rise.


def test_eta_of_a_rise_is_that_of_the_heights_of_com_and_zmp_and_repeats() -> None:
    gait, rise = gait_over(STAIRS), STAIRS.rise
    line, step = ComLine(gait.period, TICK), 9
    assert gait.rise(step) == pytest.approx(rise)
    planes, eta = gait.planes(step), gait.eta(rise)
    for q in range(gait.period):
        z, _, acceleration = gait.height(q)
        weight = gait.region.weight[q]
        of_zmp = (1.0 - weight) * planes[0, 0] + weight * planes[1, 0]
        over = line(q, planes, *np.zeros((3, 2)))
        assert eta[q] == pytest.approx((acceleration + over[2] + 9.81) / (z + over[0] - of_zmp))
    np.testing.assert_array_equal(gait.eta(), gait.height.eta())
    assert gait.rises == {rise}


@given(st.integers(0, PERIOD - 1), st.integers(0, 2**32 - 1))
def test_eta_at_a_tick_is_that_of_an_even_rise_on_stairs_and_that_of_level_ground_on_a_slope(q: int, seed: int) -> None:
    state = np.random.default_rng(seed).normal(scale=0.1, size=(2, 3))
    over_stairs, over_slope = gait_over(STAIRS), gait_over(Slope(at=-9.0, length=99.0, angle_deg=8.0, roll_deg=-3.0))
    assert UnevenEta(over_stairs)(9 * PERIOD + q, state) == pytest.approx(over_stairs.eta(STAIRS.rise)[q])
    assert UnevenEta(over_slope)(9 * PERIOD + q, state) == pytest.approx(over_slope.eta()[q])
