"""The sensors on the robot measure what it does, and the walk on their estimate is that of the true state."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from scipy.spatial.transform import Rotation

from pdhocbf_drake.analysis import figures_estimate
from pdhocbf_drake.analysis.degraded import degraded_rows
from pdhocbf_drake.analysis.estimate import yaw_errors
from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.replay_estimate import EstimateMarker
from pdhocbf_drake.analysis.replay_stage import Stage
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.estimation import ContactEkf, Memory, Notice, Sample
from pdhocbf_drake.estimation.config import samples_in_tick
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import FINISHED, RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import make_diagram, simulate

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


@pytest.mark.parametrize(
    ("rate", "tick", "step", "samples"),
    [(500.0, 0.01, 0.001, 5), (500.0, 0.005, 0.001, 1), (2000.0, 0.01, 0.001, 10), (1000.0, 0.01, 0.005, 2),
     (50.0, 0.01, 0.001, 1), (400.0, 0.01, 0.0005, 4), (300.0, 0.01, 0.001, 2)],
)  # fmt: skip
def test_a_tick_has_whole_samples_of_whole_steps_of_the_plant(rate, tick, step, samples):
    assert samples_in_tick(rate, tick, step) == samples


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


def test_a_log_has_the_sample_that_the_controller_was_given(log):
    """The filter alone, fed with the log's sensors, estimates at each tick what the log has, to the last bit."""
    scenario = load_scenario("walking_sensors")
    estimator, memory = ContactEkf(Biped.load("biped"), scenario.measurement, scenario.tick), Memory()
    support = log.element("gait_phase", "support")
    for k, sensors in enumerate(zip(log["imu"], log["encoders"], log["force_torque"], strict=True)):
        memory, estimate = estimator.step(memory, Sample(*sensors, log["desired_state"][k], support[k]))
        np.testing.assert_array_equal(memory.estimate, log["base_estimate"][k])
        np.testing.assert_array_equal(estimate.lip_state, log["lip_estimate"][k])
        np.testing.assert_array_equal(estimate.status, log["estimator_status"][k])


def test_the_walk_is_not_slower_and_is_never_recovered(log):
    assert not np.any(log.signals["solver_status"][:, 5])
    assert np.min(log.signals["h"]) > 0.0


def test_errors_are_no_larger_than_the_filter_says(log):
    """NEES of eight degrees of freedom: 95 % of χ² are below 15.5."""
    assert np.mean(log.signals["estimate_error"][STANDING:, 8] < 15.5) > 0.9


def test_a_context_copied_in_mid_walk_continues_bit_for_bit():
    logged = make_diagram(load_scenario("walking_sensors"))
    simulator = Simulator(logged.diagram)
    for adjust in logged.adjust:
        adjust(simulator.get_mutable_context())
    simulator.AdvanceTo(0.9)
    other = Simulator(logged.diagram, simulator.get_context().Clone())
    tables = []
    for each in (simulator, other):
        each.AdvanceTo(1.1)
        tables.append(logged.recorded(each.get_context()).signals)
    timed = {"solver_status"}  # it holds the solver's wall time
    assert {name for name in tables[0] if tables[0][name].tobytes() != tables[1][name].tobytes()} <= timed


def test_the_metrics_say_how_far_the_estimate_is_from_the_truth(log):
    scenario = load_scenario("walking_sensors")
    found = compute_metrics(scenario, log, 1.0, robot_limits(scenario)).estimator
    assert found.position_drift < 0.01
    assert found.height_rms < 0.005
    assert max(found.velocity_rms) < 0.006
    assert found.nees_within > 0.9
    assert found.contact_errors < 0.1
    assert not found.notices


def test_faults_one_after_another_are_noticed_and_the_robot_walks_on():
    faults = (
        "{time: 1.25, duration: 0.1, sensor: gyroscope, kind: stuck}, "
        "{time: 1.5, duration: 0.3, sensor: imu, kind: lost}, "
        "{time: 1.9, sensor: left_force_torque, kind: zero}, {time: 2.05, sensor: left_knee_pitch, kind: stuck}"
    )
    scenario = load_scenario("walking_sensors", f"{{duration: 2.6, measurement: {{faults: [{faults}]}}}}")
    failing = simulate(scenario)
    notices = failing.signals["estimator_status"][:, 0].astype(int)
    assert failing.ending == FINISHED
    assert not notices[:125].any()
    assert (notices[127:135] & Notice.GYROSCOPE).all()
    assert (notices[150:180] & (Notice.GYROSCOPE | Notice.ACCELEROMETER)).all()
    assert (notices[193:] & Notice.FORCE_TORQUE).any()
    assert (notices[215:] & Notice.ENCODER > 0).mean() > 0.9  # where the knee passes its stuck angle, that is right
    assert not np.any(failing.signals["solver_status"][:, 5])


def test_yaw_errors_are_those_of_two_rotations(log, base):
    turn, _ = base
    rows = log.signals["base_estimate"][:, :9].reshape(-1, 3, 3)
    error = (Rotation.from_matrix(rows) * turn.inv()).as_rotvec()[:, 2]
    np.testing.assert_allclose(yaw_errors(log), error, atol=1e-4)


def test_the_figure_shows_estimate_and_truth(log):
    figure = figures_estimate.estimate(Run.of(load_scenario("walking_sensors"), log))
    assert [axes.get_ylabel().partition(" [")[2] for axes in figure.axes] == ["m/s]", "mm/s]", "mm]", "1]"]


def test_nothing_is_wrong_with_the_sensors(log):
    assert not np.any(log.signals["estimator_status"][:, 0])


def test_a_replay_shows_the_estimate(log):
    stage = Stage()
    marker = EstimateMarker(stage, log)
    with stage.frame(0.5):
        marker.draw(50)
    assert stage.meshcat.HasPath(f"{stage.world}/CoM estimated")


def test_a_report_names_what_was_wrong_with_the_sensors(log):
    status = log.signals["estimator_status"].copy()
    status[100:110, 0], status[200, 0] = Notice.GYROSCOPE, Notice.GYROSCOPE | Notice.SLIP
    failing = RunLog({**log.signals, "estimator_status": status}, log.time, log.ending)
    rows = degraded_rows(Run.of(load_scenario("walking_sensors"), failing))
    assert rows == [("sensors, tick 100", "GYROSCOPE; 9 more like it"), ("sensors, tick 200", "GYROSCOPE, SLIP")]
