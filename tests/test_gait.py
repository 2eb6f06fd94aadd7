"""The stance sequence, the ZMP boxes, the CoM height and the swing foot."""

from itertools import pairwise

import numpy as np
import pytest

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking import CosineHeight, Gait, GaitConfig, swing_point


def test_steps_alternate_and_advance_by_a_stride() -> None:
    gait = Gait(GaitConfig(stride=0.15, start_steps=2, first_stance="right"))
    assert [gait.support(j) for j in range(6)] == [0, 0, -1, 1, -1, 1]
    steps = [gait.step(j) for j in range(2, 8)]
    moves = np.diff([s.centre for s in steps], axis=0)
    np.testing.assert_allclose(moves[:, 0], 0.15)
    np.testing.assert_allclose(np.abs(moves[:, 1]), gait.config.stance_width)
    for now, following in pairwise(steps):
        assert now.landing is not None
        np.testing.assert_allclose(now.landing, following.centre)


@pytest.mark.parametrize("first", ["left", "right"])
def test_the_left_foot_stands_on_the_left(first: str) -> None:
    gait = Gait(GaitConfig(start_steps=1, first_stance=first, walk_steps=4))
    for j in range(1, 5):
        step = gait.step(j)
        assert step.landing is not None
        np.testing.assert_allclose([step.centre[1], -step.landing[1]], step.support * gait.config.stance_width / 2.0)


def test_stands_with_both_feet_beside_each_other_at_the_end() -> None:
    gait = Gait(GaitConfig(stride=0.15, start_steps=1, walk_steps=3))
    last = gait.step(3)
    assert [gait.support(j) for j in range(6)] == [0, -1, 1, -1, 0, 0]
    assert last.landing is not None
    np.testing.assert_allclose(last.landing, last.centre * [1, -1])
    np.testing.assert_allclose(gait.step(4).centre, [last.centre[0], 0.0])


def test_the_box_moves_in_equal_parts_during_double_support_and_jumps_without() -> None:
    moving = Gait(GaitConfig(double_support_ticks=4)).box_weight
    np.testing.assert_allclose(np.diff(np.concatenate([[0.0], moving]))[:5], 0.2)
    assert np.all(moving[4:] == 1.0)
    assert np.all(Gait(GaitConfig(double_support_ticks=0)).box_weight == 1.0)


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
