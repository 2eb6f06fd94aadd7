"""metrics.json against separate formulas, on synthetic logs."""

from __future__ import annotations

import json

import numpy as np
import pytest
import synthetic
from pydrake.geometry.optimization import HPolyhedron, VPolytope
from synthetic import MARGIN, SPEED, STRIDE, TICK, N

from pdhocbf_drake.analysis.answers import answers
from pdhocbf_drake.analysis.feet import hull_margins, slip_max, zmp_margins
from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.metrics_schema import BarrierMetrics, Metrics, MpcMetrics
from pdhocbf_drake.analysis.path_metrics import torso_yaw
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.analysis.summary import summary_rows
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.run_log import FELL, RunLog

LIMITS = RobotLimits(
    sole_half=np.array([[0.1, 0.06], [0.1, 0.06]]),
    effort=np.full(12, 40.0),
    position=np.tile([-0.5, 0.4], (12, 1)),
    speed=np.full(12, 5.0),
    weight=284.0,
)

PROMISED = {
    "schema", "scenario", "template", "fell", "simulated_seconds", "wall_seconds", "real_time_factor", "steps_taken",
    "distance", "mean_speed", "lateral_drift", "yaw_drift_deg", "com_rms_error", "zmp_margin_min",
    "zmp_outside_fraction", "slip_max", "joint_torque_peak", "torque_limit_hits", "barriers", "mpc",
}  # fmt: skip


def metrics(log: RunLog, limits: RobotLimits | None = LIMITS) -> Metrics:
    return compute_metrics(synthetic.scenario("biped" if limits else "vhip"), log, 2.0, limits)


@pytest.fixture
def log() -> RunLog:
    return synthetic.walk_log()


def test_every_promised_key_is_there_and_documented(log):
    data = json.loads(metrics(log).to_json())
    assert set(data) >= PROMISED
    assert data["schema"] == 1
    barrier = {"h_min", "h_mean", "violations", "psi_min", "gamma", "relative_degree", "unit"}
    barrier |= {"slack_max", "softened_ticks", "active_ticks", "active_first", "active_slower"}
    assert set(data["barriers"]["forward_speed"]) == barrier
    mpc = {"solves", "fallbacks", "failures", "slack_max", "tick_seconds_median", "tick_seconds_p99", "solver"}
    assert set(data["mpc"]) == mpc | {"degraded"}
    for model in (Metrics, BarrierMetrics, MpcMetrics):
        for name, field in model.model_fields.items():
            assert field.description or name in ("barriers", "mpc")


def test_a_known_walk(log):
    found = metrics(log)
    assert (found.steps_taken, found.fell, found.template) == (8, False, False)
    assert found.simulated_seconds == pytest.approx(4.0)
    assert found.real_time_factor == pytest.approx(2.0)
    assert found.distance == pytest.approx(SPEED * 4.0)
    assert found.distance_commanded == pytest.approx((8 - 0.5) * STRIDE)
    assert found.mean_speed == pytest.approx(SPEED, abs=1e-3)
    assert found.lateral_drift == pytest.approx(0.0, abs=1e-12)
    assert found.com_rms_error == pytest.approx([0.003, 0.004, 0.005])
    assert (found.joint_torque_peak, found.torque_limit_hits) == (10.0, 0)
    assert found.joint_position_margin_min == pytest.approx(0.3)
    assert found.joint_speed_margin_min == pytest.approx(5.0)


def test_a_known_barrier(log):
    found = metrics(log).barriers["forward_speed"]
    assert found.h_min == pytest.approx(MARGIN)
    assert found.h_mean == pytest.approx(MARGIN)
    # Constant h: every psi_i is gamma_i times the one before.
    assert found.psi_min == pytest.approx(0.5 * 0.5 * MARGIN)
    assert (found.violations, found.relative_degree, found.gamma, found.unit) == (0, 2, [0.5, 0.5], "m/s")


def test_the_relative_degree_is_the_declared_one_where_psi_has_a_lower_order(log):
    scenario = synthetic.scenario("vhip")
    first_order = scenario.barriers["forward_speed"].model_copy(update={"gamma": (0.5,), "relative_degree": 2})
    scenario = scenario.model_copy(update={"barriers": {"forward_speed": first_order}})
    found = compute_metrics(scenario, log, 1.0, None)
    assert found.barriers["forward_speed"].relative_degree == 2
    assert "least ψ_1 " in dict(summary_rows(found))["barrier forward_speed"]


def test_barriers_are_judged_from_from_time_on_only(log):
    log["h"][:200] = -1.0
    assert metrics(log).barriers["forward_speed"].violations == 0
    log["h"][200:203] = [[-0.01], [-0.02], [-0.03]]
    found = metrics(log).barriers["forward_speed"]
    assert found.violations == 3
    assert found.h_min == -0.03
    rest = len(log) - 203
    assert found.h_mean == pytest.approx((rest * MARGIN - 0.06) / (rest + 3))
    h = log["h"][200:, 0]
    first = h[1:] - h[:-1] + 0.5 * h[:-1]
    assert found.psi_min == pytest.approx((first[1:] - first[:-1] + 0.5 * first[:-1]).min())


def test_a_run_that_ends_before_from_time_has_no_margins():
    found = metrics(synthetic.walk_log(duration=1.0)).barriers["forward_speed"]
    assert (found.h_min, found.h_mean, found.violations, found.psi_min) == (None, None, None, None)
    assert json.loads(metrics(synthetic.walk_log(duration=1.0)).to_json())["mean_speed"] is None


def test_numbers_of_a_body_are_null_on_a_template():
    data = json.loads(metrics(synthetic.walk_log(robot=False), None).to_json())
    assert data["template"] is True
    assert data["com_rms_error"][2] is None
    for key in ("yaw_drift_deg", "zmp_margin_min", "slip_max", "joint_torque_peak", "torque_limit_hits"):
        assert data[key] is None
    assert data["steps_taken"] == 8
    assert data["zmp_outside_fraction"] == 0.0


def test_an_oscillator_has_barriers_only():
    data = json.loads(
        compute_metrics(synthetic.scenario("van_der_pol"), synthetic.oscillator_log(), 1.0, None).to_json()
    )
    assert list(data["barriers"]) == ["x1_upper", "x1_lower", "x2_upper", "x2_lower"]
    assert data["barriers"]["x1_upper"]["relative_degree"] == 2
    assert data["barriers"]["x2_lower"]["unit"] == "1/s"
    assert data["mpc"] is None
    assert data["distance"] is None


def test_a_fall_is_reported_and_its_step_not_counted():
    log = synthetic.walk_log(duration=3.9, ending=FELL)
    found = metrics(log)
    assert found.fell
    assert found.ending == "fell"
    assert found.steps_taken == 7


def test_a_foot_that_never_leaves_the_ground_takes_no_step(log):
    log["foot_state"][:, [2, 8]] = 0.0
    assert metrics(log).steps_taken == 0


def test_slip_is_the_farthest_way_from_where_the_foot_first_stood(log):
    assert slip_max(log) == 0.0
    standing = (log.time > 1.3) & (log.time < 1.5)  # the left foot carries from 1.2 s to 1.6 s
    log["foot_state"][standing, 0] += 0.003
    log["foot_state"][standing, 1] -= 0.004
    assert slip_max(log) == pytest.approx(0.005)


def test_a_swinging_foot_does_not_slip(log):
    swinging = (log.time > 0.85) & (log.time < 1.15)
    log["foot_state"][swinging, 0] += 0.3
    assert slip_max(log) == 0.0


def test_the_zmp_margin_is_the_distance_to_the_edge_of_the_sole(log):
    row = round(1.4 / TICK)  # on the left foot, in mid-step
    centre = log["foot_state"][row, :2]
    for offset, margin in (((0, 0), 0.06), ((0.07, 0), 0.03), ((0, -0.05), 0.01), ((0, 0.08), -0.02)):
        log["lip_state"][row, [2, 5]] = centre + np.array(offset)
        assert zmp_margins(log, LIMITS.sole_half)[row] == pytest.approx(margin)


@pytest.mark.parametrize("yaw", [0.3, -0.3, np.pi / 2])
def test_the_zmp_margin_turns_with_the_foot(log, yaw):
    row = round(1.4 / TICK)
    log["foot_state"][row, 5] = yaw
    ahead = np.array([np.cos(yaw), np.sin(yaw)])
    log["lip_state"][row, [2, 5]] = log["foot_state"][row, :2] + 0.09 * ahead
    assert zmp_margins(log, LIMITS.sole_half)[row] == pytest.approx(0.01)


def test_a_foot_that_lands_tilted_supports_with_the_corners_that_touch(log):
    row = round(1.4 / TICK)  # on the left foot, in mid-step
    left, tilt = log["foot_state"][row, :6], 0.1
    log["foot_state"][row, 6:] = [left[0] + 0.2, left[1] - 0.16, 0.1 * np.sin(tilt), 0.0, tilt, 0.0]  # on its toes
    log["lip_state"][row, [2, 5]] = left[0] + 0.25, left[1] - 0.16
    toes = left[0] + 0.2 + 0.1 * np.cos(tilt)
    assert zmp_margins(log, LIMITS.sole_half)[row] > 0.02
    log["lip_state"][row, 2] = toes + 0.01
    assert zmp_margins(log, LIMITS.sole_half)[row] == pytest.approx(-0.01)
    log["foot_state"][row, 8] += 2e-3  # a little higher, it carries nothing
    assert zmp_margins(log, LIMITS.sole_half)[row] == pytest.approx(-np.hypot(toes - left[0] - 0.09, 0.1))


def test_there_is_no_margin_without_a_corner_on_the_ground(log):
    log["foot_state"][100, [2, 8]] = 0.01
    margins = zmp_margins(log, LIMITS.sole_half)
    assert np.flatnonzero(np.isinf(margins)).tolist() == [100]
    assert metrics(log).zmp_margin_min == pytest.approx(margins.min())


def test_margins_are_distances_from_the_edge_of_the_hull():
    random = np.random.default_rng(1)
    for count in (1, 2, 3, 6):
        corners, points = random.normal(size=(count, 2)), random.normal(size=(30, 2))
        found = hull_margins(points, np.tile(corners, (30, 1, 1)), np.ones((30, count), dtype=bool))
        hull = VPolytope(corners.T)
        for point, margin in zip(points, found, strict=True):
            inside, nearest = hull.PointInSet(point), hull.Projection(point)[1][:, 0]
            assert (margin >= 0) == inside
            if not inside:
                assert -margin == pytest.approx(np.linalg.norm(point - nearest), abs=1e-5)
            elif count > 2:
                edges = HPolyhedron(hull)
                distance = (edges.b() - edges.A() @ point) / np.linalg.norm(edges.A(), axis=1)
                assert margin == pytest.approx(distance.min())


def test_ticks_without_load_on_the_ground_are_counted(log):
    load = np.full((len(log), 1), 285.0)
    load[[0, 70, 71]] = 0.0  # at the start no contact has been found yet
    loaded = RunLog({**log.signals, "ground_load": load}, log.time)
    found = metrics(loaded)
    assert found.unloaded_ticks == 2
    assert "no load on the ground at 2 ticks" in dict(summary_rows(found))["ZMP"]
    assert metrics(log).unloaded_ticks is None  # an older log


def test_what_is_used_of_the_ground_is_that_of_the_wrench_at_the_zmp(log):
    force, zmp, about = np.array([30.0, -40.0, 250.0]), np.array([0.3, -0.1, 0.0]), 5.0
    base = log["robot_state"][100, 4:7]
    log["contact_forces"][100, :6] = np.concatenate([np.cross(zmp - base, force), force])
    log["contact_forces"][100, 2] += about
    log["contact_forces"][200, :6] = [0.0, 0.0, 9.0, 9.0, 0.0, 1e-3]  # the ground carries next to nothing
    found = metrics(log)
    assert found.friction_used_max == pytest.approx(50.0 / 250.0)
    assert found.yaw_moment_used_max == pytest.approx(about / 250.0)
    assert "friction of 0.200 is used" in dict(summary_rows(found))["ground"]
    older = RunLog({name: table for name, table in log.signals.items() if name != "contact_forces"}, log.time)
    assert metrics(older).friction_used_max is metrics(older).yaw_moment_used_max is None


def test_torques_are_told_joint_by_joint_and_against_their_limits(log):
    log["actuation"][50, 3] = -25.0
    log["feedforward"][60, 9] = 41.0  # more than there is, and so clipped where it is applied
    found = metrics(log)
    assert found.torque_peaks["left_knee_pitch"] == 25.0
    assert found.torque_peaks["right_knee_pitch"] == 10.0
    assert found.torque_margin_min == pytest.approx(-1.0)


def test_standing_feet_support_between_them_too(log):
    assert zmp_margins(log, LIMITS.sole_half)[0] == pytest.approx(0.1)  # the front edge is nearer than the sides


def test_samples_outside_the_box_are_counted(log):
    log["lip_state"][100:110, 2] = log["zmp_box"][100:110, 1] + 1e-6
    log["lip_state"][200:210, 5] = log["zmp_box"][200:210, 2] - 1e-6
    assert metrics(log).zmp_outside_fraction == pytest.approx(20 / len(log))
    log["lip_state"][200:210, 5] = log["zmp_box"][200:210, 2] - 1e-10  # rounding is not outside
    assert metrics(log).zmp_outside_fraction == pytest.approx(10 / len(log))


def test_drifts_ignore_the_sway_and_have_no_sign(log):
    turn = np.radians(-3.0) * log.time / log.time[-1]
    log["robot_state"][:, 0], log["robot_state"][:, 3] = np.cos(turn / 2), np.sin(turn / 2)
    log["lip_state"][:, 3] -= 0.01 * log.time
    found = metrics(log)
    late = log.time[-2 * N :].mean()
    assert found.lateral_drift == pytest.approx(0.01 * late, rel=1e-3)
    assert found.yaw_drift_deg == pytest.approx(3.0 * late / 4.0, rel=1e-3)
    assert torso_yaw(log, [1.0, 0.0, 0.0])[-1] == pytest.approx(np.radians(-3.0))
    assert torso_yaw(log, [0.0, 1.0, 0.0])[-1] == pytest.approx(np.radians(87.0))


@pytest.mark.parametrize(("aside", "left"), [(0.11, False), (0.13, True)])
def test_a_walk_that_is_a_soles_width_beside_its_path_has_left_it(log, aside, left):
    log["lip_state"][N:, 3] += aside
    found = metrics(log)
    assert found.left_path is left
    assert ("THE WALK LEFT ITS PATH" in dict(summary_rows(found))["straightness"]) is left


def test_torques_at_the_limit_are_counted(log):
    log["actuation"][5, 3], log["actuation"][6:8, 4] = -40.0, 40.0
    found = metrics(log)
    assert (found.joint_torque_peak, found.torque_limit_hits) == (40.0, 3)


@pytest.mark.parametrize(("share", "kept"), [(0.004, True), (0.02, False)])
def test_limits_that_are_reached_in_more_than_half_a_percent_of_the_ticks_are_not_kept(log, share, kept):
    ticks = int(share * len(log))
    log["actuation"][:ticks, 3] = log["actuation"][:ticks, 9] = 40.0  # both knees: two samples of a tick
    found = metrics(log)
    assert (found.torque_limit_hits, found.torque_limit_fraction) == (2 * ticks, ticks / len(log))
    assert ("TORQUE LIMITS ARE NOT KEPT" not in dict(summary_rows(found))["joints"]) is kept
    assert ("TORQUE LIMITS ARE NOT KEPT" not in answers(found)[-1].text) is kept


def test_solver_failures_and_fallbacks_are_counted(log):
    log["solver_status"][50:52, 0], log["solver_status"][50:52, 4] = 0.0, [1.0, 2.0]
    log["solver_status"][60, 3] = 0.02
    log["solver_status"][70, 1] = 1.0
    found = metrics(log).mpc
    assert (found.solves, found.failures, found.fallbacks, found.slack_max) == (400, 2, 2, 0.02)
    assert found.tick_seconds_median == pytest.approx(1e-4)
    assert found.tick_seconds_p99 == pytest.approx(1e-4)


@pytest.mark.parametrize(("barrier", "failures"), [("soft", 5), ("hard", 8)])
def test_failures_are_ticks_whose_own_problem_had_no_optimum(barrier, failures):
    run = synthetic.run("vhip")
    reasons = [Reason.CROSS_SOLVED, Reason.RELAXED, Reason.INFEASIBLE, Reason.NOT_OPTIMAL, *[Reason.SOFTENED] * 2]
    reasons += [Reason.NO_STEADY_PLAN, Reason.RECOVERING, Reason.STOPPING, Reason.SOLVED, Reason.STALE_MEASUREMENT]
    run.log["solver_status"][50 : 50 + len(reasons), 5] = reasons
    run.log["solver_status"][57, 3] = 0.02  # a disturbed walk may break a barrier at a low price, a hard one too
    mpc = run.scenario.mpc.model_copy(update={"barrier": barrier})
    found = compute_metrics(run.scenario.model_copy(update={"mpc": mpc}), run.log, 2.0, None).mpc
    # Where the barrier is soft its slack is part of what the scenario states.
    assert found.failures == failures
    assert found.degraded["softened"] == 2
    assert found.degraded["recovering"] == 1
    assert found.degraded["no_steady_plan"] == 1


def test_nan_becomes_null_and_not_a_crash(log):
    log["lip_state"][300, :] = np.nan
    log["h"][300] = np.nan
    data = json.loads(metrics(log).to_json())
    assert data["com_rms_error"][0] is None
    assert data["zmp_margin_min"] is None
    assert data["barriers"]["forward_speed"]["h_min"] is None


def test_an_empty_log_has_metrics_too():
    log = synthetic.walk_log()
    empty = RunLog({name: table[:0] for name, table in log.signals.items()}, log.time[:0], "interrupted")
    data = json.loads(metrics(empty).to_json())
    assert data["ending"] == "interrupted"
    assert data["steps_taken"] is None
    assert data["mpc"]["solves"] == 0


def test_a_violation_is_more_than_rounding(log):
    log["h"][300:303, 0] = [-5.55e-17, -1e-10, -1e-8]  # of a bound of some 0.4 m/s
    assert metrics(log).barriers["forward_speed"].violations == 1
