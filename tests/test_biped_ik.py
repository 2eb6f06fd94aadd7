"""Whole-body inverse kinematics: round trip, mirror symmetry, derivatives, and what it does out of reach."""

from __future__ import annotations

import numpy as np
import pytest
from biped_cases import biped, ik, mirrored, mirrored_joints, random_posture, standing

from pdhocbf_drake.robot import Posture, PostureRates, WholeBodyIk, sole_pose
from pdhocbf_drake.robot.ik import TOLERANCE


@pytest.mark.parametrize("seed", range(60))
def test_forward_kinematics_undo_inverse_kinematics(seed: int) -> None:
    target = random_posture(np.random.default_rng(seed))
    result = ik().solve(target, biped().bent_knee)
    assert result.ok and result.error < TOLERANCE, result.reason
    ik().task_space.set_positions(result.q)
    for found, wanted in zip(ik().task_space.posture(), target, strict=True):
        np.testing.assert_allclose(found, wanted, atol=5e-8)
    joints = result.q[biped().q_index]
    assert (joints >= biped().position_limits[:, 0]).all() and (joints <= biped().position_limits[:, 1]).all()


@pytest.mark.parametrize("seed", range(20))
def test_mirrored_target_gives_mirrored_legs(seed: int) -> None:
    target = random_posture(np.random.default_rng(seed))
    q = ik().solve(target, biped().bent_knee).q
    image = ik().solve(mirrored(target), biped().bent_knee).q
    np.testing.assert_allclose(image[biped().q_index], mirrored_joints(q[biped().q_index]), atol=1e-7)


def test_knees_bend_forward_when_standing() -> None:
    q = ik().solve(standing(), biped().bent_knee).q
    assert (q[biped().q_index][[3, 9]] > 0.5).all()
    np.testing.assert_allclose(q[biped().base_q_index[:4]], [1, 0, 0, 0], atol=1e-8)


def moving(t: float) -> tuple[Posture, PostureRates, PostureRates]:
    """A smooth motion of every target (rotations about z), with its first and second derivatives."""
    s, c = np.sin(3 * t), np.cos(3 * t)
    yaw = np.array([0.0, 0.0, 1.0])
    com, left, right = np.array([0.04, 0.03, 0.015]), np.array([0.1, 0.02, 0.02]), np.array([-0.08, 0.01, -0.02])
    places = Posture(
        np.array([0.0, 0.0, 0.56]) + com * s,
        np.concatenate([np.array([0.0, 0.09, 0.03]) + left * s, 0.15 * yaw * s]),
        np.concatenate([np.array([0.0, -0.09, 0.03]) + right * s, -0.1 * yaw * c]),
        0.1 * yaw * s,
    )
    first = PostureRates(
        3 * com * c, 3 * np.concatenate([left, 0.15 * yaw]) * c,
        3 * np.concatenate([right * c, 0.1 * yaw * s]), 0.3 * yaw * c,
    )  # fmt: skip
    second = PostureRates(
        -9 * com * s, -9 * np.concatenate([left, 0.15 * yaw]) * s,
        9 * np.concatenate([-right * s, 0.1 * yaw * c]), -0.9 * yaw * s,
    )  # fmt: skip
    return places, first, second


@pytest.mark.parametrize("t", [0.0, 0.2, 0.5, 0.9])
def test_rates_and_accelerations_are_the_derivatives_of_the_solution(t: float) -> None:
    step = 1e-4
    motions = [ik().motion(*moving(t + n * step), biped().bent_knee) for n in (-1, 0, 1)]
    before, here, after = motions
    plant, context = biped().plant, ik().task_space.context
    plant.SetPositions(context, here.q)
    differences = plant.MapQDotToVelocity(context, (after.q - before.q) / (2 * step))
    np.testing.assert_allclose(here.v, differences, atol=2e-5)
    np.testing.assert_allclose(here.vdot, (after.v - before.v) / (2 * step), atol=2e-4)
    assert abs(here.v).max() > 0.2 and abs(here.vdot).max() > 0.5  # there is something to compare


def test_warm_start_needs_few_iterations() -> None:
    q = ik().solve(moving(0.2)[0], biped().bent_knee).q
    for tick in range(1, 20):
        result = ik().solve(moving(0.2 + 0.01 * tick)[0], q)
        assert result.ok and result.iterations <= 3
        q = result.q


@pytest.mark.parametrize("height", [0.625, 0.64, 0.66, 0.75, 2.0])
def test_near_and_beyond_straight_knees_it_stays_within_limits_and_says_so(height: float) -> None:
    result = ik().solve(standing(height), biped().bent_knee)
    joints = result.q[biped().q_index]
    assert np.isfinite(result.q).all()
    assert (joints >= biped().position_limits[:, 0]).all() and (joints <= biped().position_limits[:, 1]).all()
    assert result.ok == (height < 0.63)
    if not result.ok:
        assert result.reason.startswith("CoM z misses by ") and result.error > 1e-3
        ik().task_space.set_positions(result.q)
        # What is given up is the CoM, not the ground under the feet.
        assert all(abs(sole[2]) < 0.05 * abs(result.error) for sole in ik().task_space.sole_positions())


def test_a_blocked_joint_is_named() -> None:
    squat = ik().solve(standing(0.25), biped().bent_knee)
    assert not squat.ok and "left_knee_pitch, right_knee_pitch" in squat.reason and "at the limit" in squat.reason


def test_straight_legs_still_give_finite_velocities_within_limits() -> None:
    straight = np.array(biped().bent_knee)
    straight[biped().q_index] = 0.0
    upward = PostureRates(np.array([0.0, 0.0, 1.0]), np.zeros(6), np.zeros(6))
    v = ik().rates(straight, upward)
    assert np.isfinite(v).all() and (abs(v[biped().v_index]) <= biped().velocity_limits).all()
    assert np.isfinite(ik().accelerations(straight, v, upward)).all()


def test_it_recovers_from_a_failed_solve() -> None:
    failed = ik().solve(standing(0.75), biped().bent_knee)
    assert ik().solve(standing(), failed.q).ok


@pytest.mark.parametrize("bad", ["target", "seed"])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e200])
def test_what_is_no_place_is_answered_not_raised(bad: str, value: float) -> None:
    target, seed = standing(), np.array(biped().bent_knee)
    if bad == "target":
        target = target._replace(com=np.array([value, 0.0, 0.58]))
    else:
        seed[8] = value
    result = ik().solve(target, seed)
    assert np.isfinite(result.q).all()
    assert result.ok == (bad == "seed")
    assert result.reason == ("" if bad == "seed" else "the target is not finite, or beyond 1e+06 m")


def test_a_seed_that_is_turned_nowhere_is_not_started_from() -> None:
    seed = np.array(biped().bent_knee)
    seed[biped().base_q_index[:4]] = 0.0
    assert ik().solve(standing(), seed).ok


def test_a_turn_by_half_a_revolution_is_not_taken_for_no_turn() -> None:
    upside_down = standing()._replace(torso_rpy=np.array([np.pi, 0.0, 0.0]))
    assert not ik().solve(upside_down, biped().bent_knee).ok


def test_two_solvers_do_not_share_state() -> None:
    other = WholeBodyIk(biped())
    ik().solve(standing(0.5), biped().bent_knee)
    first = other.solve(standing(), biped().bent_knee).q
    ik().solve(standing(0.55), biped().bent_knee)
    np.testing.assert_array_equal(other.solve(standing(), biped().bent_knee).q, first)


def test_turned_feet_turn_the_robot() -> None:
    turn = 0.4
    com = np.array([0.02 * np.cos(turn), 0.02 * np.sin(turn), 0.58])
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    left, right = (sole_pose(*(rotation @ [0.02, y]), yaw=turn) for y in (0.08, -0.08))
    turned = ik().solve(Posture(com, left, right, np.array([0.0, 0.0, turn])), biped().bent_knee)
    straight = ik().solve(standing(), biped().bent_knee)
    np.testing.assert_allclose(turned.q[biped().q_index], straight.q[biped().q_index], atol=1e-7)
