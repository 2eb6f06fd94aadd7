"""Whole-body inverse kinematics: round trip, mirror symmetry, derivatives, and targets out of reach."""

from __future__ import annotations

import numpy as np
import pytest
from biped_cases import biped, ik, mirrored, mirrored_joints, posture_at, random_posture, standing

from pdhocbf_drake.robot import Motion, Posture, WholeBodyIk, sole_pose
from pdhocbf_drake.robot.ik import TOLERANCE
from pdhocbf_drake.robot.posture import COM, LEFT, RIGHT, TURNS


@pytest.mark.parametrize("seed", range(60))
def test_forward_kinematics_undo_inverse_kinematics(seed: int) -> None:
    target = random_posture(np.random.default_rng(seed))
    result = ik().solve(target, biped().bent_knee)
    assert result.ok, result.reason
    assert result.error < TOLERANCE, result.reason
    for found, wanted in zip(posture_at(result.q), target, strict=True):
        np.testing.assert_allclose(found, wanted, atol=5e-8)
    joints = result.q[biped().q_index]
    assert (joints >= biped().position_limits[:, 0]).all()
    assert (joints <= biped().position_limits[:, 1]).all()


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


def moving_robot(t: float, seed: np.ndarray | None = None) -> Motion:
    """The robot at time t of a smooth motion of all task coordinates, whose rotations are about z."""
    s, c = np.sin(3 * t), np.cos(3 * t)
    sine, cosine = np.array([s, 3 * c, -9 * s]), np.array([c, -3 * s, -9 * c])  # with their derivatives
    wanted, angles = np.zeros((3, 18)), np.zeros((3, 3))
    wanted[:, COM] = np.outer(sine, [0.04, 0.03, 0.015])
    wanted[:, LEFT] = np.outer(sine, [0.1, 0.02, 0.02])
    wanted[:, RIGHT] = np.outer(sine, [-0.08, 0.01, -0.02])
    for place, centre in ((COM, [0.0, 0.0, 0.56]), (LEFT, [0.0, 0.09, 0.03]), (RIGHT, [0.0, -0.09, 0.03])):
        wanted[0, place] += centre
    for i, yaw in enumerate((0.1 * sine, 0.15 * sine, -0.1 * cosine)):
        angles[i, 2], wanted[1:, TURNS[i].stop - 1] = yaw[0], yaw[1:]
    return ik().motion(wanted, biped().bent_knee if seed is None else seed, None, tuple(angles.ravel().tolist()))


@pytest.mark.parametrize("t", [0.0, 0.2, 0.5, 0.9])
def test_rates_and_accelerations_are_the_derivatives_of_the_solution(t: float) -> None:
    step = 1e-4
    motions = [moving_robot(t + n * step) for n in (-1, 0, 1)]
    before, here, after = motions
    plant, context = biped().plant, biped().plant.CreateDefaultContext()
    plant.SetPositions(context, here.q)
    differences = plant.MapQDotToVelocity(context, (after.q - before.q) / (2 * step))
    np.testing.assert_allclose(here.v, differences, atol=2e-5)
    np.testing.assert_allclose(here.vdot, (after.v - before.v) / (2 * step), atol=2e-4)
    assert abs(here.v).max() > 0.2
    assert abs(here.vdot).max() > 0.5  # there is something to compare


def test_warm_start_needs_few_iterations() -> None:
    q = moving_robot(0.2).q
    for tick in range(1, 20):
        result = moving_robot(0.2 + 0.01 * tick, q).ik
        assert result.ok
        assert result.iterations <= 3
        q = result.q


@pytest.mark.parametrize("height", [0.625, 0.64, 0.66, 0.75, 2.0])
def test_near_and_beyond_straight_knees_it_stays_within_limits_and_gives_a_reason(height: float) -> None:
    result = ik().solve(standing(height), biped().bent_knee)
    joints = result.q[biped().q_index]
    assert np.isfinite(result.q).all()
    assert (joints >= biped().position_limits[:, 0]).all()
    assert (joints <= biped().position_limits[:, 1]).all()
    assert result.ok == (height < 0.63)
    if not result.ok:
        assert result.reason.startswith("CoM z misses by ")
        assert result.error > 1e-3
        # The CoM misses its target, while the soles stay on the ground.
        found = posture_at(result.q)
        assert abs(found.left[2]) < 0.05 * result.error
        assert abs(found.right[2]) < 0.05 * result.error


def test_a_blocked_joint_is_named() -> None:
    squat = ik().solve(standing(0.25), biped().bent_knee)
    assert not squat.ok
    assert "left_knee_pitch, right_knee_pitch" in squat.reason
    assert "at the limit" in squat.reason


def test_straight_legs_still_give_finite_velocities_within_limits() -> None:
    straight = np.array(biped().bent_knee)
    straight[biped().q_index] = 0.0
    upward = np.zeros(18)
    upward[COM] = [0.0, 0.0, 1.0]
    v, vdot = ik().derivatives(straight, upward, upward)
    assert np.isfinite(v).all()
    assert (abs(v[biped().v_index]) <= biped().velocity_limits).all()
    assert np.isfinite(vdot).all()


def test_it_recovers_from_a_failed_solve() -> None:
    failed = ik().solve(standing(0.75), biped().bent_knee)
    assert ik().solve(standing(), failed.q).ok


@pytest.mark.parametrize("bad", ["target", "seed"])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e200])
def test_a_target_or_seed_that_is_not_finite_raises_nothing(bad: str, value: float) -> None:
    target, seed = standing(), np.array(biped().bent_knee)
    if bad == "target":
        target = target._replace(com=np.array([value, 0.0, 0.58]))
    else:
        seed[8] = value
    result = ik().solve(target, seed)
    assert np.isfinite(result.q).all()
    assert result.ok == (bad == "seed")
    assert result.reason == ("" if bad == "seed" else "the target is not finite, or beyond 1e+06 m")


def test_a_seed_without_an_orientation_is_replaced() -> None:
    seed = np.array(biped().bent_knee)
    seed[biped().base_q_index[:4]] = 0.0
    assert ik().solve(standing(), seed).ok


def test_a_turn_by_half_a_revolution_is_an_error() -> None:
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
