"""When a plan was at a bound of joints, legs or feet, from logs whose ZMP and footholds are known."""

from __future__ import annotations

import numpy as np
import synthetic

from pdhocbf_drake.analysis.metrics import compute_metrics
from pdhocbf_drake.analysis.plan_limits import at_plan_limits
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.analysis.summary import summary_rows
from pdhocbf_drake.mpc.config import PlanLimits, RecoveryConfig
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.run_folder import Run

BODY = RobotLimits(
    np.full((2, 2), [0.11, 0.07]), np.full(12, 50.0), np.tile([-2.0, 2.0], (12, 1)), np.full(12, 9.0), 284.0
)
LIMITS = PlanLimits(zmp_behind=0.04, zmp_ahead=0.05, zmp_inward=0.02, zmp_outward=0.03, step_reach=(0.3, 0.4))
STEP = 40  # ticks
NEXT = slice(4, 6)  # of stance_plan


def walk(**limits: object) -> Run:
    """A walk whose ZMP is always in the middle of the stance foot, which is the right one in even steps."""
    run = synthetic.run()
    mpc = run.scenario.mpc.model_copy(update={"limits": LIMITS.model_copy(update=limits), "recovery": RecoveryConfig()})
    run.log.signals["whole_body_zmp"] = run.log["stance_plan"][:, 2:4].copy()
    return run._replace(scenario=run.scenario.model_copy(update={"mpc": mpc}))


def found(run: Run) -> dict[str, list[int]]:
    """The rows of each bound at which a plan was."""
    return {name: np.flatnonzero(at).tolist() for name, at in at_plan_limits(run.scenario, run.log).items() if at.any()}


def test_far_from_all_bounds_none_is_active_and_nothing_is_said():
    run = walk()
    assert found(run) == {}
    metrics = compute_metrics(run.scenario, run.log, 1.0, BODY)
    assert {bound.active_ticks for bound in metrics.plan_limits.values()} == {0}
    assert "limits of the plan" not in dict(summary_rows(metrics))


def test_an_ankle_is_at_its_bound_where_the_zmp_is_as_far_as_it_carries_it_on_either_foot():
    run = walk()
    zmp = run.log.signals["whole_body_zmp"]
    zmp[90:93, 0] += 0.05  # ahead
    zmp[95, 0] += 0.049
    zmp[130, 0] -= 0.04  # behind
    zmp[100, 1] -= 0.03  # outward of the right foot
    zmp[[102, 140], 1] += 0.03  # inward of it, outward of the left one
    zmp[142, 1] += 0.02
    zmp[80, 0] += 0.05  # where the other foot still carries load
    zmp[40, 0] += 0.05  # in a stand
    ahead, aside = {"zmp_behind": [130], "zmp_ahead": [90, 91, 92]}, {"zmp_inward": [102], "zmp_outward": [100, 140]}
    assert found(run) == ahead | aside


def test_hips_and_knees_are_at_their_bound_where_a_disturbed_walk_has_its_zmp_at_the_end_of_what_they_hold():
    held = [(-0.02, 0.03)] * STEP
    held[15] = (-0.06, 0.06)
    run = walk(zmp_held=tuple(held), zmp_behind=0.1, zmp_ahead=0.1)
    zmp, reason = run.log.signals["whole_body_zmp"], run.log.element("solver_status", "reason")
    assert not reason.any()
    zmp[[90, 95, 110], 0] += [-0.02, -0.02, 0.03]
    assert found(run) == {}
    status = run.log.signals["solver_status"] = run.log["solver_status"].copy()
    status[85:, -1] = float(Reason.RECOVERING)
    assert found(run)["zmp_held"] == [90, 110]


def test_a_step_is_at_its_bounds_as_a_disturbed_walk_has_them():
    run = walk()
    run.log["stance_plan"][90, 4] += 0.15
    run.log["stance_plan"][91, 5] += 0.24
    run.log["stance_plan"][[92, 93], 5] -= 0.015
    run.log["solver_status"][[90, 91, 92], 5] = Reason.RECOVERING
    assert found(run) == {"step_reach_x": [90], "step_reach_y": [91], "stance_width_min": [92]}


def test_what_is_active_is_the_same_for_the_same_walk_with_another_heading():
    here, there = walk(), walk()
    for run, yaw in ((here, 0.0), (there, 0.7)):
        run.log["whole_body_zmp"][90:93, 0] += 0.05
        run.log["stance_plan"][90:95, NEXT] += [0.15, 0.0]
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        run.log.signals["stance_plan"] = (run.log["stance_plan"].reshape(-1, 2) @ turn.T).reshape(-1, 8)
        run.log.signals["whole_body_zmp"] = run.log["whole_body_zmp"] @ turn.T
        run.log.signals["turn_reference"] = np.full((len(run.log), 9), yaw)
        run.log["solver_status"][90:95, 5] = Reason.RECOVERING
    assert found(here) == found(there) == {"zmp_ahead": [90, 91, 92], "step_reach_x": [90, 91, 92, 93, 94]}


def test_a_granted_stride_is_active_while_the_robot_walks_and_is_said():
    run = walk(stride=0.15)
    metrics = compute_metrics(run.scenario, run.log, 1.0, BODY)
    walking = np.flatnonzero(run.log.element("gait_phase", "support"))
    assert found(run)["stride"] == walking.tolist()
    said = dict(summary_rows(metrics))["limits of the plan"]
    assert said == f"stride at {len(walking)} ticks, first at {run.log.time[walking[0]]:.2f} s"
