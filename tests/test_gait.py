"""Footsteps, the support region, the CoM height and the minimum-jerk swing."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking import CosineHeight, Gait, GaitConfig, swing_point
from pdhocbf_drake.walking.support import SupportRegion, contains


def test_steps_alternate_and_advance_by_a_stride() -> None:
    gait = Gait(GaitConfig(stride=0.15, start_steps=2, first_stance="right"))
    assert [gait.support(j) for j in range(6)] == [0, 0, -1, 1, -1, 1]
    moves = np.diff([gait.foothold(j) for j in range(2, 8)], axis=0)
    np.testing.assert_allclose(moves[:, 0], 0.15)
    np.testing.assert_allclose(np.abs(moves[:, 1]), gait.config.stance_width)


@settings(deadline=None)
@given(st.floats(-1.0, 1.0), st.integers(0, 5), st.integers(0, 10_000), st.sampled_from([None, 1, 2, 5000]))
def test_a_straight_walk_s_footholds_are_products_rounded_once(
    stride: float, start: int, ahead: int, steps: int | None
) -> None:
    gait = Gait(GaitConfig(stride=stride, start_steps=start, walk_steps=steps))
    x, y = gait.foothold(start + ahead)
    if steps is None or ahead < steps:
        assert (x, y) == (stride * ahead, (-1) ** (ahead + 1) * gait.config.stance_width / 2.0)
    else:
        assert (x, y) == (stride * (steps - 1), 0.0)


def test_every_footstep_starts_where_the_one_before_ends() -> None:
    for gait in (Gait(GaitConfig()), Gait(GaitConfig(start_steps=0)), Gait(GaitConfig(walk_steps=3))):
        for j in range(-3, 12):
            assert (gait.step(j).start, gait.step(j).ticks) == (40 * j, 40)


def test_before_its_first_tick_a_walk_stands_at_its_start() -> None:
    for start in (0, 2):
        gait = Gait(GaitConfig(start_steps=start))
        assert [gait.support(j) for j in (-7, -1)] == [0, 0]
        np.testing.assert_array_equal([gait.foothold(-7), gait.foothold(-1)], np.zeros((2, 2)))
        np.testing.assert_array_equal(gait.feet_at_start, [[0.0, 0.08], [0.0, -0.08]])


@pytest.mark.parametrize("first", ["left", "right"])
def test_the_left_foot_stands_on_the_left(first: str) -> None:
    gait = Gait(GaitConfig(start_steps=1, first_stance=first, walk_steps=4))
    for j in range(1, 5):
        assert gait.foothold(j)[1] == gait.support(j) * gait.config.stance_width / 2.0


def test_stands_with_both_feet_beside_each_other_at_the_end() -> None:
    gait = Gait(GaitConfig(stride=0.15, start_steps=1, walk_steps=3))
    assert [gait.support(j) for j in range(6)] == [0, -1, 1, -1, 0, 0]
    last, stand = gait.foothold(3), gait.foothold(4)
    np.testing.assert_array_equal(stand, [last[0], 0.0])
    np.testing.assert_allclose(2.0 * stand - last, last * [1, -1])  # where the other foot is, seen from the middle


def test_a_walk_ends_where_it_is_ended_first() -> None:
    walk = Gait(GaitConfig(start_steps=2))
    assert [walk.ending_at(4).support(j) for j in range(7)] == [0, 0, -1, 1, -1, 0, 0]
    assert [walk.ending_at(1).support(j) for j in range(4)] == [0, 0, 0, 0]
    assert walk.ending_at(4).has_end
    ended = Gait(GaitConfig(start_steps=2, walk_steps=3))
    for j in (5, 9):
        assert [ended.ending_at(j).support(i) for i in range(12)] == [ended.support(i) for i in range(12)]
    np.testing.assert_array_equal(ended.ending_at(9).foothold(9), ended.foothold(9))


def test_another_stride_begins_where_the_old_one_ends() -> None:
    walk = Gait(GaitConfig(stride=0.15, start_steps=2))
    x = [walk.with_stride(0.2, 10).foothold(step)[0] for step in range(8, 40)]
    np.testing.assert_allclose(np.diff(x), [0.15, 0.15, *[0.2] * 29])
    early = [walk.with_stride(0.2, 0).foothold(step)[0] for step in range(-2, 8)]
    np.testing.assert_allclose(np.diff(early), [0.0, 0.0, 0.0, 0.0, 0.2, 0.2, 0.2, 0.2, 0.2])
    twice = walk.with_stride(0.2, 20).with_stride(0.1, 10).foothold(30)[0]
    assert twice == pytest.approx(8 * 0.15 + 20 * 0.1)


def test_a_walk_with_another_stride_keeps_its_footholds_in_every_walk_derived_from_it() -> None:
    walk = Gait(GaitConfig(stride=0.15, start_steps=2)).with_stride(0.16, 30)
    assert walk.foothold(40)[0] == pytest.approx(5.80, abs=1e-12)
    for derived in (walk.with_box((0.18, 0.11)), walk.ending_at(40), walk.with_box((0.18, 0.11)).ending_at(45)):
        np.testing.assert_array_equal(derived.foothold(40), walk.foothold(40))
    np.testing.assert_array_equal(walk.ending_at(40).foothold(50), [walk.foothold(40)[0], 0.0])
    ended = Gait(GaitConfig(stride=0.15, start_steps=2, walk_steps=39)).with_stride(0.16, 30)
    np.testing.assert_array_equal(ended.foothold(50), walk.ending_at(40).foothold(50))


def test_another_box_changes_nothing_else() -> None:
    walk = Gait(GaitConfig(walk_steps=4))
    wide = walk.with_box((0.18, 0.12))
    assert wide.footsteps == walk.footsteps
    np.testing.assert_array_equal(wide.region.half(wide.support(3)), [0.09, 0.06])
    np.testing.assert_array_equal(wide.region.weight, walk.region.weight)


def test_footsteps_of_another_timing_are_refused() -> None:
    gait = Gait(GaitConfig())
    listed = list(gait.footsteps.listed)
    listed[3] = listed[3]._replace(ticks=30)
    with pytest.raises(InputError) as error:
        Gait(gait.config, replace(gait.footsteps, listed=tuple(listed)))
    assert str(error.value) == (
        "footstep 2: must start at tick 80 and last gait.ticks_per_step, 40 ticks (given: 80, 30)"
    )


def test_the_box_moves_in_equal_parts_during_double_support_and_jumps_without() -> None:
    moving = Gait(GaitConfig(double_support_ticks=4)).region.weight
    np.testing.assert_allclose(np.diff(np.concatenate([[0.0], moving]))[:5], 0.2)
    assert np.all(moving[4:] == 1.0)
    assert np.all(Gait(GaitConfig(double_support_ticks=0)).region.weight == 1.0)


def test_the_box_of_a_stand_is_that_of_a_foot_and_the_width_between_the_feet() -> None:
    gait = Gait(GaitConfig(zmp_box=(0.1, 0.06), stance_width=0.2, start_steps=1))
    np.testing.assert_allclose(gait.region.half(gait.support(1)), [0.05, 0.03])
    np.testing.assert_allclose(gait.region.half(gait.support(0)), [0.05, 0.13])


REGION = SupportRegion(GaitConfig(ticks_per_step=12, double_support_ticks=3))


@settings(deadline=None)
@given(st.integers(0, 11), st.floats(0.0, 0.02), st.integers(0, 2**32 - 1))
def test_the_box_at_the_next_tick_is_the_first_of_the_weights(phase: int, margin: float, seed: int) -> None:
    """Machine code against plain numpy."""
    random = np.random.default_rng(seed)
    centres, half = random.normal(size=(2, 4)), random.uniform(0.05, 0.2, (2, 4))
    box = REGION.box(phase, centres[:, :2], centres[:, 2:], half, margin)
    row = REGION.weights(phase, 24, 2)[0]
    middle, side = centres @ row, half @ row + margin
    np.testing.assert_allclose(box, np.column_stack([middle - side, middle + side]), atol=1e-15)


@settings(deadline=None)
@given(st.integers(0, 11), st.integers(0, 2**32 - 1))
def test_a_zmp_meets_the_rows_where_its_box_contains_it(phase: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    centres, half, zmp = random.normal(size=4), random.uniform(0.5, 2.0, 4), random.normal(size=24)
    met = [sign * zmp + on_centres @ centres + on_half @ half >= 0.0
           for sign, on_centres, on_half in REGION.rows(phase, 24, 2)]  # fmt: skip
    weights = REGION.weights(phase, 24, 2)
    middle, side = weights @ centres, weights @ half
    boxes = np.stack([middle - side, middle + side], axis=-1)[:, None]
    np.testing.assert_array_equal(np.logical_and(*met), contains(boxes, zmp[:, None]))


def test_the_path_of_the_centre_is_that_of_the_weights() -> None:
    stances = np.random.default_rng(3).normal(size=5)
    np.testing.assert_allclose(REGION.centres(stances, 37)[1:], REGION.weights(0, 36, 3) @ stances, atol=1e-15)
    np.testing.assert_allclose(REGION.centres(stances, 1)[0], 0.75 * stances[0] + 0.25 * stances[1])


def test_a_box_contains_its_edge_and_no_nan() -> None:
    box = np.array([[0.0, 1.0], [-1.0, 1.0]])
    assert contains(box, np.array([1.0, -1.0]))
    assert not contains(box, np.array([1.0, -1.0 - 1e-6]))
    assert contains(box, np.array([1.0, -1.0 - 1e-6]), tolerance=1e-5)
    assert not contains(box, np.array([np.nan, 0.0]))


def test_height_derivatives_agree_with_finite_differences_and_eta_with_its_definition() -> None:
    config = GaitConfig(com_height_amplitude=0.01, com_height_phase=7, ticks_per_step=4000, tick=1e-4)
    height = CosineHeight(config)
    z, vz, az = np.array([height(k) for k in range(-1, 4001)]).T
    np.testing.assert_allclose((z[2:] - z[:-2]) / 2e-4, vz[1:-1], atol=1e-6)
    np.testing.assert_allclose((vz[2:] - vz[:-2]) / 2e-4, az[1:-1], atol=1e-4)
    np.testing.assert_allclose(height.eta(), ((az + 9.81) / z)[1:-1])
    assert int(np.argmax(z[1:-1])) == 7
    np.testing.assert_allclose(height(3), height(4003))


def test_swing_starts_and_ends_at_rest_and_is_highest_in_the_middle() -> None:
    start, end = np.array([0.0, 0.1]), np.array([0.3, 0.12])
    for time, place in ((0.0, start), (0.4, end)):
        point = swing_point(start, end, 0.05, 0.4, time)
        np.testing.assert_allclose(point.position, [*place, 0.0], atol=1e-12)
        np.testing.assert_allclose(point.velocity, 0.0, atol=1e-12)
        np.testing.assert_allclose(point.acceleration, 0.0, atol=1e-9)
    assert swing_point(start, end, 0.05, 0.4, 0.2).position[2] == pytest.approx(0.05)


def test_swing_velocity_and_acceleration_are_derivatives() -> None:
    start, end, eps = np.array([0.0, 0.1]), np.array([0.3, 0.12]), 1e-6
    for time in (0.05, 0.13, 0.31):
        before, at, after = (swing_point(start, end, 0.05, 0.4, time + d) for d in (-eps, 0.0, eps))
        np.testing.assert_allclose((after.position - before.position) / (2 * eps), at.velocity, atol=1e-7)
        np.testing.assert_allclose((after.velocity - before.velocity) / (2 * eps), at.acceleration, atol=1e-6)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"double_support_ticks": 20}, "gait.double_support_ticks: must be below half a step, 20 ticks (given: 20)"),
        ({"com_height_amplitude": 0.6}, "gait.com_height_amplitude: must be below the CoM height 0.58 m (given: 0.6)"),
        (
            {"com_height_amplitude": 0.05},
            "gait.com_height_amplitude: must be below 0.0398 m, where the CoM would fall freely at its top "
            "in steps of 0.4 s (given: 0.05)",
        ),
    ],
)
def test_what_cannot_be_walked_is_refused_in_one_sentence(values: dict, message: str) -> None:
    with pytest.raises(InputError) as error:
        Gait(GaitConfig(**values))
    assert str(error.value) == message
