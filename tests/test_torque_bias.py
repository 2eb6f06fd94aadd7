"""What the model lacks of a standing leg's torque: learned, sent to that leg, and nothing for what the gait makes."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.systems.signals import JOINTS
from pdhocbf_drake.systems.torque_bias import TorqueBias
from pdhocbf_drake.walking import Gait, GaitConfig

GAIT = Gait(GaitConfig(ticks_per_step=40))
WEIGHT = 300.0
LIMITS = np.full(len(JOINTS), 100.0)
BIAS = TorqueBias(GAIT, WEIGHT, LIMITS)
BAND = 0.01 * WEIGHT * GAIT.config.com_height
LOAD = BAND * np.array([0.0, 0.8, -1.0, 2.0, 0.5, 0.5])  # on a leg that stands, from hip yaw to ankle roll
LEARNED = np.array([0.0, 1.0, 1.0, 1.0, 0.0, 0.0])
FEEDFORWARD = np.linspace(-5.0, 5.0, len(JOINTS))


def walked(load: np.ndarray, steps: int, memory: np.ndarray = BIAS.start, reason: Reason = Reason.SOLVED) -> np.ndarray:
    """The memory after so many steps of a robot whose standing leg needs more than the feedforward, the left first."""
    status = np.array([1.0, 0.0, 0.0, 0.0, 0.0, float(reason)])
    for step in range(steps):
        leg = step % 2
        applied = FEEDFORWARD.copy()
        applied[6 * leg : 6 * leg + 6] += load
        for tick in range(40):
            memory = BIAS.learned(memory, np.array([tick, step, 1.0 - 2.0 * leg]), status, FEEDFORWARD, applied)
    return memory


def added(memory: np.ndarray) -> np.ndarray:
    bias, sent = BIAS.torques(memory, FEEDFORWARD).reshape(2, -1)
    np.testing.assert_array_equal(sent, FEEDFORWARD + bias)
    return bias.reshape(2, 6)


def test_what_a_load_needs_is_sent_to_the_hip_and_knee_of_the_leg_that_stands() -> None:
    left, right = walked(LOAD, 20), walked(LOAD, 21)  # each ends with a step on the other leg
    np.testing.assert_allclose(added(left), [np.zeros(6), LEARNED * LOAD], atol=0.01)
    np.testing.assert_allclose(added(right), [LEARNED * LOAD, np.zeros(6)], atol=0.01)


def test_what_is_added_moves_to_the_other_leg_over_a_few_ticks() -> None:
    memory, moving = walked(LOAD, 20), []
    for tick in range(5):
        memory = BIAS.learned(memory, np.array([tick, 20.0, 1.0]), np.zeros(6), FEEDFORWARD, FEEDFORWARD)
        moving.append(added(memory)[0, 3])
    np.testing.assert_allclose(moving, LOAD[3] * np.array([0.25, 0.5, 0.75, 1.0, 1.0]), atol=0.01)


def test_nothing_is_added_for_what_the_gait_itself_makes() -> None:
    assert not added(walked(0.4 * LOAD, 40)).any()


def test_no_joint_is_sent_more_than_it_has() -> None:
    memory, limits = walked(LOAD, 20), np.full(len(JOINTS), 5.0)  # the feedforward goes up to that
    bias, sent = TorqueBias(GAIT, WEIGHT, limits).torques(memory, FEEDFORWARD).reshape(2, -1)
    np.testing.assert_allclose(sent, np.clip(FEEDFORWARD + added(memory).ravel(), -5.0, 5.0), atol=1e-12)
    assert abs(bias - added(memory).ravel()).max() > 0.1
    beyond = TorqueBias(GAIT, WEIGHT, 0.5 * limits).torques(memory, FEEDFORWARD)[12:]
    assert (abs(beyond) <= np.maximum(abs(FEEDFORWARD), 2.5) + 1e-12).all()


@pytest.mark.parametrize("reason", [Reason.RECOVERING, Reason.NO_STEADY_PLAN])
def test_a_push_teaches_nothing(reason: Reason) -> None:
    assert not walked(LOAD, 4, reason=reason)[:12].any()


def test_torques_of_a_tick_move_it_little_and_those_that_are_no_numbers_not_at_all() -> None:
    tick = np.array([20.0, 0.0, 1.0])
    blow = BIAS.learned(BIAS.start, tick, np.zeros(6), FEEDFORWARD, FEEDFORWARD + 1e4)
    assert np.linalg.norm(blow[:12]) < 0.1 * BAND
    lost = BIAS.learned(BIAS.start, tick, np.zeros(6), FEEDFORWARD, np.full(12, np.nan))
    np.testing.assert_array_equal(lost[:12], BIAS.start[:12])
