"""The sensors on the robot measure what it does, and the walk on their estimate is that of the true state."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.run_log import FINISHED, RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

TICK, TIME = 0.01, 3.0
STANDING = 80  # ticks
GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module")
def log() -> RunLog:
    """A walk on the sensors' estimate."""
    return simulate(load_scenario("walking_sensors", f"duration: {TIME}"))


@pytest.fixture(scope="module")
def base(log) -> tuple[Rotation, np.ndarray]:
    """The base's true orientation and velocity at each tick."""
    state = log.signals["robot_state"]
    return Rotation.from_quat(state[:, [1, 2, 3, 0]]), state[:, 22:25]


def test_it_walks_to_its_end(log):
    assert log.ending == FINISHED


def test_the_gyroscope_joins_the_turn_over_a_tick(log, base):
    turn, _ = base
    rates = (turn[:-1].inv() * turn[1:]).as_rotvec() / TICK
    error = log.signals["imu"][1:, :3] - rates
    bias = load_scenario("walking_sensors").measurement.imu.gyro_bias
    assert np.all(np.abs(error.mean(axis=0)) < 4.0 * bias)
    noise = load_scenario("walking_sensors").measurement.imu.gyro_noise / np.sqrt(TICK)
    np.testing.assert_allclose(error.std(axis=0), noise, rtol=0.3)


def test_the_accelerometer_joins_the_change_of_velocity_over_a_tick(log, base):
    turn, velocity = base
    gained = turn[:-1].inv().apply(np.diff(velocity, axis=0) - TICK * GRAVITY) / TICK
    error = log.signals["imu"][1:, 3:6] - gained
    imu = load_scenario("walking_sensors").measurement.imu
    assert np.all(np.abs(error.mean(axis=0)) < 4.0 * imu.accelerometer_bias)
    np.testing.assert_allclose(error.std(axis=0), imu.accelerometer_noise / np.sqrt(TICK), rtol=0.5)


def test_the_encoders_are_off_by_what_calibration_leaves(log):
    error = (log.signals["encoders"] - log.signals["joint_state"])[:, :12]
    assert np.all(np.abs(error.mean(axis=0)) < 4.0 * load_scenario("walking_sensors").measurement.encoders.calibrated)
    assert np.all(error.std(axis=0) < 2.0 * np.pi / 2**17)


def test_sole_forces_carry_the_robot(log):
    """Newton's law of the CoM over a tick, but for the feet's own inertia and the sensors' offsets."""
    forces, rise = log.signals["force_torque"], np.diff(log.signals["com_z"][:, 1]) / TICK
    carried = Biped.load("biped").mass * (9.81 + rise)
    error = (forces[:, 5] + forces[:, 11])[1:] - carried
    assert np.sqrt(np.mean(error**2)) < 12.0


def test_the_estimate_is_the_truth_within_the_accuracy_that_the_walk_needs(log):
    error = (log.signals["lip_estimate"] - log.signals["lip_state"])[STANDING:]
    rms = np.sqrt(np.mean(error**2, axis=0))
    assert rms[1] < 0.006
    assert rms[4] < 0.006
    assert np.abs(error[:, [0, 3]]).max() < 0.01


def test_the_walk_is_not_slower_and_is_never_recovered(log):
    assert not np.any(log.signals["solver_status"][:, 5])
    assert np.min(log.signals["h"]) > 0.0


def test_errors_are_no_larger_than_the_filter_says(log):
    """NEES of eight degrees of freedom: 95 % of χ² are below 15.5."""
    assert np.mean(log.signals["estimate_error"][STANDING:, 8] < 15.5) > 0.9


def test_nothing_is_wrong_with_the_sensors(log):
    assert not np.any(log.signals["estimator_status"][:, 0])
