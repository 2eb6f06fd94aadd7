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

TURN = [{"time": 0.0, "velocity": [0.25, 0.0], "turn": 0.5}]


def walked(
    commands: list[dict], duration: float, start: dict | None = None, pushes: tuple[dict, ...] = ()
) -> tuple[Scenario, RunLog]:
    base = load_scenario("walking_nobarrier").to_dict()
    data = {**base, "commands": commands, "duration": duration, "pushes": pushes, "plant": {"time_step": 0.005}}
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
    yaw = 1.0
    _, one = turning
    _, other = walked(TURN, 5.0, {"position": [30.0, -40.0], "yaw": yaw})
    moved = one["lip_state"][:, [0, 3]] @ rotation(yaw).T + [30.0, -40.0]
    np.testing.assert_allclose(other["lip_state"][:, [0, 3]], moved, atol=1e-9)
    np.testing.assert_allclose(other["joint_state"][:, :12], one["joint_state"][:, :12], atol=1e-9)


@pytest.mark.parametrize("yaw", [1.0, -2.5])
def test_the_plant_of_a_robot_that_starts_at_a_heading_is_the_same_in_the_worlds_axes(yaw: float) -> None:
    """State and contact forces of its first steps on the ground, from which a solver's tolerance is left out."""
    tables = []
    for angle in (0.0, yaw):
        base = load_scenario("walking_nobarrier").to_dict()
        data = {**base, "commands": [{"time": 0.0, "stop": True}], "start": {"yaw": angle}, "duration": 0.05}
        log = simulate(Scenario.from_dict(data, "heading"))
        tables.append((log["joint_state"], log["lip_state"].reshape(-1, 2, 3), log["contact_forces"], log["com_z"]))
    (joints, com, forces, height), (other_joints, other_com, other_forces, other_height) = tables
    np.testing.assert_allclose(other_joints, joints, atol=1e-12)
    np.testing.assert_allclose(other_height, height, atol=1e-13)
    np.testing.assert_allclose(other_com, rotation(yaw) @ com, atol=1e-11)
    for first in (0, 3):  # moment and force on the base
        turned = forces[:, first : first + 2] @ rotation(yaw).T
        np.testing.assert_allclose(other_forces[:, first : first + 2], turned, atol=1e-7)
    np.testing.assert_allclose(other_forces[:, 6:], forces[:, 6:], atol=1e-7)


def test_a_pushed_robot_recovers_alike_at_any_heading_and_goes_on_turning() -> None:
    _, one = walked(TURN, 4.5, pushes=({"time": 2.5, "force": [0.0, 80.0, 0.0]},))
    _, other = walked(TURN, 4.5, {"yaw": math.pi / 2}, ({"time": 2.5, "force": [-80.0, 0.0, 0.0]},))
    np.testing.assert_allclose(other["joint_state"][:, :12], one["joint_state"][:, :12], atol=1e-6)
    recovering = np.flatnonzero(one.element("solver_status", "reason") >= Reason.RECOVERING)
    assert one.ending == "finished"
    assert recovering[0] > 250 and recovering[-1] < 400
    # It keeps its heading while it recovers, without a jump of the headings to which feet and torso turn.
    yaws, rates = one["turn_reference"].reshape(-1, 3, 3)[:, :, 0], one["turn_reference"].reshape(-1, 3, 3)[:, :, 1]
    within = one.element("gait_phase", "tick")[1:] > 1.0
    np.testing.assert_allclose(np.diff(yaws, axis=0)[within], 0.005 * (rates[1:] + rates[:-1])[within], atol=1e-3)
    path = one.element("path", "yaw")
    assert abs(path[recovering[-1]] - path[recovering[0]]) < 0.25 < 0.5 * 0.01 * len(recovering)


def test_a_walk_that_is_to_go_and_turn_as_far_as_it_can_at_once_is_never_without_a_plan() -> None:
    command = "commands: [{time: 1.0, velocity: [2.0, 0], turn: 3.0}]"
    log = simulate(load_scenario("walking", f"{{duration: 2.1, plant: {{time_step: 0.005}}, {command}}}"))
    assert set(log.element("solver_status", "reason")) <= {Reason.SOLVED, Reason.SOFTENED}


def test_feet_turn_from_rest_to_rest_from_one_heading_of_the_path_to_the_next(turning: tuple[Scenario, RunLog]) -> None:
    _, log = turning
    rows = np.flatnonzero((log.element("gait_phase", "tick") == 0.0) & (log.time > 1.5))
    headings = log["turn_reference"].reshape(-1, 3, 3)
    np.testing.assert_allclose(headings[rows, :, 1:], 0.0, atol=1e-9)
    right = log.element("gait_phase", "support")[rows] < 0.0
    landed = headings[rows, right.astype(int), 0]
    np.testing.assert_allclose(landed, log.element("path", "yaw")[rows], atol=1e-9)


def test_a_straight_walk_has_no_headings() -> None:
    gait = Gait(load_scenario("walking").gait)
    assert not gait.turns
    assert gait.foot_yaws(7) == (0.0,) * 4
