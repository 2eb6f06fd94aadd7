"""The robot follows commands: turns, stops, and walks alike from anywhere."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.metrics_schema import Metrics
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.gait import Gait
from pdhocbf_drake.walking.swing import turned_heading

TURN = [{"time": 0.0, "velocity": [0.25, 0.0], "turn": 0.5}]


def walked(
    commands: list[dict], duration: float, start: dict | None = None, pushes: tuple[dict, ...] = ()
) -> tuple[Scenario, RunLog]:
    base = load_scenario("walking_nobarrier").to_dict()
    data = {**base, "commands": commands, "duration": duration, "pushes": pushes}
    scenario = Scenario.from_dict({**data, "start": start or {}}, "commands")
    return scenario, simulate(scenario)


def metrics_of(scenario: Scenario, log: RunLog) -> Metrics:
    return compute_metrics(scenario, log, 1.0, robot_limits(scenario))


@pytest.fixture(scope="module")
def turning() -> tuple[Scenario, RunLog]:
    return walked(TURN, 5.0)


def test_the_robot_turns_at_the_commanded_rate_and_its_soles_stay_apart(turning: tuple[Scenario, RunLog]) -> None:
    found = metrics_of(*turning)
    assert found.ending == "finished"
    assert found.turn_rate == pytest.approx(0.5, rel=0.05)
    assert found.mean_speed == pytest.approx(0.25, rel=0.08)
    assert found.sole_gap_min is not None and found.sole_gap_min > 0.01
    assert found.zmp_outside_fraction is not None and found.zmp_outside_fraction < 0.08
    assert found.mpc is not None and not found.mpc.degraded


def test_the_robot_walks_alike_from_another_place_and_heading(turning: tuple[Scenario, RunLog]) -> None:
    yaw = math.pi / 2
    _, one = turning
    _, other = walked(TURN, 5.0, {"position": [30.0, -40.0], "yaw": yaw})
    moved = one["lip_state"][:, [0, 3]] @ rotation(yaw).T + [30.0, -40.0]
    np.testing.assert_allclose(other["lip_state"][:, [0, 3]], moved, atol=1e-6)
    np.testing.assert_allclose(other["joint_state"][:, :12], one["joint_state"][:, :12], atol=1e-6)


def test_a_pushed_robot_recovers_alike_at_any_heading_and_goes_on_turning() -> None:
    _, one = walked(TURN, 4.5, pushes=({"time": 2.5, "force": [0.0, 80.0, 0.0]},))
    _, other = walked(TURN, 4.5, {"yaw": math.pi / 2}, ({"time": 2.5, "force": [-80.0, 0.0, 0.0]},))
    np.testing.assert_allclose(other["joint_state"][:, :12], one["joint_state"][:, :12], atol=1e-6)
    recovering = np.flatnonzero(one.element("solver_status", "reason") >= Reason.RECOVERING)
    assert one.ending == "finished"
    assert recovering[0] > 250 and recovering[-1] < 400


def test_the_robot_stops_and_starts_again() -> None:
    commands = [{"time": 0.0, "velocity": [0.3, 0.0]}, {"time": 2.1, "stop": True}, {"time": 4.0, "turn": -0.4}]
    scenario, log = walked(commands, 6.0)
    found = metrics_of(scenario, log)
    assert found.ending == "finished"
    support = log.element("gait_phase", "support")
    assert np.all(support[(log.time > 3.25) & (log.time < 4.0)] == 0.0)
    assert support[-1] != 0.0
    assert log.element("path", "yaw")[-1] < 0.0


def test_a_turning_foot_starts_and_ends_at_rest() -> None:
    times = np.linspace(0.0, 0.36, 3601)
    heading, rate, acceleration = np.array([turned_heading(0.1, 0.5, 0.36, time) for time in times]).T
    np.testing.assert_allclose([heading[0], heading[-1]], [0.1, 0.5])
    np.testing.assert_allclose([rate[[0, -1]], acceleration[[0, -1]]], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.gradient(heading, times)[1:-1], rate[1:-1], atol=1e-4)
    np.testing.assert_allclose(np.gradient(rate, times)[1:-1], acceleration[1:-1], atol=1e-2)


def test_a_straight_walk_has_no_headings() -> None:
    gait = Gait(load_scenario("walking").gait)
    assert not gait.turns
    assert gait.foot_yaws(7) == (0.0,) * 4
