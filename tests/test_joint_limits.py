"""Limits of the joints in the plan: ankles as a box for the ZMP, steps within reach, the stride that is granted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pdhocbf_drake.analysis.plan_limits import at_plan_limits
from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.fitting.plan_limits import plan_limits
from pdhocbf_drake.mpc.commanded import CommandedSteps
from pdhocbf_drake.mpc.config import MpcConfig, PlanLimits
from pdhocbf_drake.mpc.terms.step_limits import step_ranges
from pdhocbf_drake.robot import ROLES, Biped, InverseDynamics, WholeBodyIk, sole_pose, upright_posture
from pdhocbf_drake.robot.locate import models_folder
from pdhocbf_drake.simulation.commands import commanded_gait
from pdhocbf_drake.simulation.limits import within_limits
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.walking import Gait, GaitConfig
from pdhocbf_drake.walking.frame import rotation

PACKAGED = dict(zip(ROLES, [60.0, 100.0, 120.0, 150.0, 80.0, 60.0], strict=True))
FAR = PlanLimits(zmp_behind=1.0, zmp_ahead=1.0, zmp_inward=1.0, zmp_outward=1.0, step_reach=(1.0, 1.0))
CUT = PlanLimits(zmp_behind=0.03, zmp_ahead=0.01, zmp_inward=0.02, zmp_outward=0.04, step_reach=(0.2, 0.3))


def weaker(folder: Path, **efforts: float) -> str:
    """The packaged robot with other torque limits [N m], as a robot file."""
    source = models_folder() / "biped" / "biped.yaml"
    data = yaml.safe_load(source.read_text())
    data |= {"model": str(source.parent / data["model"]), "effort_limits": list((PACKAGED | efforts).values())}
    data["packages"] = {name: str(source.parent / place) for name, place in data["packages"].items()}
    file = folder / "weaker.yaml"
    file.write_text(yaml.safe_dump(data))
    return str(file)


def walking(robot: str, **changes: Any) -> Scenario:
    data = load_scenario("walking_nobarrier").to_dict()
    return Scenario.from_dict({**data, "robot": robot, **changes}, "walking")


def test_where_limits_are_far_nothing_changes() -> None:
    own, without = (
        load_scenario("walking", f"{{duration: 1.3, mpc: {{limits: {text}}}}}") for text in ("model", "null")
    )
    logs = [simulate(scenario) for scenario in (own, without)]
    for name, table in logs[0].signals.items():
        if name != "solver_status":  # which holds wall times
            np.testing.assert_array_equal(table, logs[1][name], err_msg=name)


def test_at_the_edge_of_the_box_the_ankle_holds_its_share_of_its_torque(tmp_path: Path) -> None:
    biped = Biped.load(weaker(tmp_path, ankle_pitch=12.0, ankle_roll=9.0))
    gait = GaitConfig(com_height_amplitude=0.0)
    limits, half = plan_limits(biped, gait), gait.stance_width / 2.0
    ik, rest = WholeBodyIk(biped), np.zeros(18)
    for axis, joint, torque, edge in (
        (0, 4, 12.0, limits.zmp_ahead), (0, 4, 12.0, -limits.zmp_behind),
        (1, 5, 9.0, limits.zmp_outward), (1, 5, 9.0, -limits.zmp_inward),
    ):  # fmt: skip
        com = np.array([0.0, half, gait.com_height])
        com[axis] += edge
        q = upright_posture(biped, com, sole_pose(0.0, half), sole_pose(0.0, -half))
        tau = InverseDynamics(biped, ik.task_space)(q, rest, rest, 1.0).tau  # stands on the left foot alone
        assert abs(tau[joint]) == pytest.approx(0.85 * torque, rel=0.05)


def test_a_sole_is_cut_alike_on_both_sides_and_in_the_foots_own_axes() -> None:
    gait = Gait(GaitConfig(zmp_box=(0.1, 0.1)))
    steps = CommandedSteps(gait, 80, 0.01, CUT).steps(4)
    assert steps.shift is not None
    sides = [gait.support(step) for step in (3, 4, 5, 6)]
    for column, side in enumerate(sides):
        low, high = steps.shift[:, column] - steps.half[:, column], steps.shift[:, column] + steps.half[:, column]
        outward, inward = (high[1], low[1]) if side > 0 else (-low[1], -high[1])
        assert (low[0], high[0]) == pytest.approx((-0.03, 0.01))
        assert (outward, inward) == pytest.approx((0.04, -0.02))
    assert CommandedSteps(gait, 80, 0.01, FAR).steps(4).shift is None
    np.testing.assert_array_equal(CommandedSteps(gait, 80, 0.01, FAR).steps(4).half, 0.04)


def test_a_box_that_is_moved_lies_alike_on_both_soles_and_not_in_a_stand() -> None:
    gait, moved = Gait(GaitConfig(zmp_box=(0.1, 0.1))), FAR.model_copy(update={"zmp_middle": (0.03, -0.02)})
    walked, stood = (CommandedSteps(gait, 80, 0.01, moved).steps(step) for step in (4, 0))
    assert walked.shift is not None
    sides = [gait.support(step) for step in (3, 4, 5, 6)]
    np.testing.assert_allclose(walked.shift, [[0.03] * 4, [-0.02 * side for side in sides]])
    np.testing.assert_allclose(walked.half, 0.04)
    assert stood.shift is not None
    np.testing.assert_allclose(stood.shift[:, 0], 0.0)


def test_the_same_walk_elsewhere_has_the_same_box() -> None:
    text = "{commands: [{time: 0.0, velocity: [0.3, 0.0], turn: 0.2}], start: {yaw: %s}}"
    here, there = (commanded_gait(load_scenario("walking_nobarrier", text % yaw)) for yaw in (0.0, 1.0))
    one, other = (CommandedSteps(gait, 80, 0.01, CUT).steps(5) for gait in (here, there))
    assert one.shift is not None
    assert other.shift is not None
    np.testing.assert_allclose(one.shift, other.shift, atol=1e-12)
    turn = here.step(6).yaw - here.step(5).yaw
    assert turn
    alone = CommandedSteps(here, 80, 0.01, CUT).steps(6).shift
    assert alone is not None
    np.testing.assert_allclose(one.shift[:, 2], rotation(turn) @ alone[:, 1], atol=1e-12)


def test_no_step_is_planned_beyond_the_reach() -> None:
    config = MpcConfig(step_reach=(0.45, 0.5), limits=CUT)
    low, high = step_ranges(config, CommandedSteps(Gait(GaitConfig()), 80, 0.0).steps(4))
    assert np.abs([low[0], high[0]]).max() == 0.2
    assert np.abs([low[1], high[1]]).max() == 0.3


def test_a_weak_ankle_walks_within_its_torque_at_full_speed(tmp_path: Path) -> None:
    own = walking("biped")
    weak = walking(weaker(tmp_path, ankle_pitch=16.6), duration=4.0)  # 80 % of what the packaged walk takes
    kept = within_limits(weak, Biped.load(weak.robot))
    assert not kept.sentences
    log = simulate(kept.scenario)
    assert log.ending == "finished"
    at = at_plan_limits(kept.scenario, log)
    assert at["zmp_ahead"].sum() > 10
    assert not any(at[name].any() for name in ("step_reach_x", "step_reach_y", "stance_width_min", "stride"))
    assert np.abs(log["feedforward"][:, [4, 10]]).max() < 16.6
    assert np.abs(log["actuation"][:, [4, 10]]).max() < 16.6
    speed = log.after(2.4).element("lip_state", "vx")[:160].mean()
    assert speed == pytest.approx(own.gait.stride / 0.4, rel=0.02)


def test_a_weak_hip_is_granted_a_shorter_stride_and_both_are_said(tmp_path: Path) -> None:
    robot, strides = weaker(tmp_path, hip_pitch=13.6), []
    for kind in ("closed_form", "auto"):  # what the whole-body program takes from the joint need not be given up
        kept = within_limits(walking(robot, whole_body={"kind": kind}), Biped.load(robot))
        strides.append(kept.scenario.gait.stride)
    assert 0.05 < strides[0] < 0.13 < strides[1] < 0.15
    (said,) = kept.sentences
    assert said.startswith(f"a stride of {kept.scenario.gait.stride:.3g} m is granted instead of 0.15 m")
    assert "hip_pitch needs 18.6 N m and has 13.6 N m" in said


@pytest.mark.parametrize("stride", [0.15, 0.0])
def test_a_hip_that_is_granted_the_walk_is_granted_a_slower_one(tmp_path: Path, stride: float) -> None:
    weak = walking(weaker(tmp_path, hip_roll=22.3), gait={"stride": stride})  # 80 % of the peak, which grows in place
    assert within_limits(weak, Biped.load(weak.robot)).scenario.gait.stride == stride


def test_all_joints_give_way_by_less_than_one_alone(tmp_path: Path) -> None:
    peaks = dict(zip(ROLES, (3.57, 27.84, 18.58, 42.28, 22.01, 15.34), strict=True))  # of the packaged walk [N m]
    almost = weaker(tmp_path, **{role: 0.99 * peak for role, peak in peaks.items()})
    assert not within_limits(walking(almost), Biped.load(almost)).sentences
    short = weaker(tmp_path, **{role: 0.95 * peak for role, peak in peaks.items()})
    with pytest.raises(ModelError, match="can't walk, not even in place"):
        within_limits(walking(short), Biped.load(short))


def test_a_weak_knee_walks_at_full_speed_with_the_zmp_farther_ahead(tmp_path: Path) -> None:
    weak = walking(weaker(tmp_path, knee_pitch=29.6), duration=4.0, plant={"time_step": 0.005})  # 70 % of the peak
    biped = Biped.load(weak.robot)
    kept = within_limits(weak, biped)
    limits = kept.scenario.mpc.plan_limits
    assert limits is not None
    ahead, outward = limits.zmp_middle
    assert kept.sentences[0].startswith(f"the middle of the ZMP box is moved {1e3 * ahead:.0f} mm ahead on the soles: ")
    assert 0.03 < ahead <= 0.5 * biped.soles["left"].half_size[0]
    assert outward == 0.0
    assert kept.scenario.gait.stride == weak.gait.stride
    log = simulate(kept.scenario)
    assert log.ending == "finished"
    knees = [3, 9]
    assert np.abs(log["feedforward"][:, knees]).max() <= 29.6
    assert (np.abs(log["actuation"][:, knees]) >= 29.6).any(axis=1).mean() < 0.005
    assert log.after(2.4).element("lip_state", "vx")[:160].mean() == pytest.approx(weak.gait.stride / 0.4, rel=0.02)


@pytest.mark.parametrize(
    ("efforts", "error"),
    [
        (
            {"knee_pitch": 10.0},
            r"can't stand: \w+_knee_pitch needs \S+ N m for that and has 10 N m, \S+ N m are",
        ),
        ({"knee_pitch": 25.0}, r"can't walk, not even in place: \w+_knee_pitch needs \S+ N m and has 25 N m"),
        ({"ankle_pitch": 1.0}, r"can't \w+.*ankle"),
    ],
)
def test_what_is_missing_is_said_with_the_joint(tmp_path: Path, efforts: dict[str, float], error: str) -> None:
    robot = weaker(tmp_path, **efforts)
    with pytest.raises(ModelError, match=error):
        simulate(walking(robot, duration=0.1))


def test_check_says_what_the_joints_leave(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "walking"]) == 0
    assert "the ankles carry the ZMP from -0.211 to 0.171 m of the soles' centres" in capsys.readouterr().out
