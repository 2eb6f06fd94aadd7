"""Default values that come from the robot: what is scaled, what is given, and what the packaged biped keeps."""

from __future__ import annotations

import dataclasses
import math
import re
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args, get_origin

import bipeds
import numpy as np
import pytest
import yaml
from pydantic import BaseModel

from pdhocbf_drake.fitting.facts import PACKAGED, RobotFacts
from pdhocbf_drake.fitting.preview import Step, is_mirrored, preview, zmp_shift
from pdhocbf_drake.fitting.rules import RULES
from pdhocbf_drake.fitting.step import SHIFT
from pdhocbf_drake.mpc.config import MpcConfig, PlanLimits, RecoveryConfig
from pdhocbf_drake.robot import Biped, models_folder, sole_pose, swing_lever, upright_posture
from pdhocbf_drake.robot.leg import leg_length
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_fitted, load_scenario, scenario_names
from pdhocbf_drake.walking import GaitConfig
from pdhocbf_drake.yaml_text import write_yaml

SIZES = (0.4, 0.5, 1.5, 1.8)
# Numbers of a gait and its controller that are the same for every robot, or belong to the robot or its step.
SCALE_FREE = {
    "gait.com_height_phase", "gait.start_steps", "gait.walk_steps", "mpc.swing_acceleration",
    "mpc.recovery.swing_acceleration", "mpc.robust.disturbance.x", "mpc.robust.disturbance.y",
    "mpc.robust.estimate", "mpc.robust.sigmas",
    "mpc.disturbance.band", "mpc.disturbance.gain", "mpc.disturbance.most", "mpc.disturbance.rate",  # accelerations
    "mpc.filter.com", "mpc.filter.model", "mpc.filter.push", "mpc.filter.velocity", "mpc.zmp_lag",  # of the hardware
}  # fmt: skip
OF_ROBOT_AND_STEP = {
    "gait.com_height", "gait.stance_width", "gait.stride", "gait.tick", "gait.ticks_per_step", "mpc.sway_weight",
}  # fmt: skip
OF_ROBOT_AND_STEP |= {f"mpc.limits.{key}" for key in PlanLimits.model_fields}


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> dict[float, Path]:
    return {size: bipeds.write(tmp_path_factory.mktemp("robots") / str(size), bipeds.resized(size)) for size in SIZES}


def moved_biped(folder: Path, **changes: Any) -> Path:
    """The packaged biped's file at another place, with keys changed."""
    source = models_folder() / "biped"
    robot = yaml.safe_load((source / "biped.yaml").read_text(encoding="utf-8"))
    robot |= {"model": str(source / robot["model"]), "packages": {"pdhocbf_models": str(source.parent)}} | changes
    path = folder / "moved.yaml"
    path.write_text(yaml.safe_dump(robot), encoding="utf-8")
    return path


def on(robot: Path, text: str = "") -> Scenario:
    return load_scenario("walking", f"{{robot: {robot}{text and ', ' + text}}}")


def test_the_values_are_written_for_the_packaged_biped() -> None:
    facts = RobotFacts.of(Biped.load("biped"))
    assert facts._replace(mass=round(facts.mass, 9)) == PACKAGED


@pytest.mark.parametrize("name", [name for name in scenario_names() if name.startswith("walking")])
def test_the_packaged_biped_keeps_its_numbers_when_they_are_worked_out(name: str, tmp_path: Path) -> None:
    robot = moved_biped(tmp_path)
    scenario, fitted = load_fitted(name, f"robot: {robot}")
    assert fitted is None
    assert scenario.to_dict() == load_scenario(name).to_dict() | {"robot": str(robot)}


def test_the_packaged_bipeds_gains_are_those_of_a_robot_of_its_weight(tmp_path: Path) -> None:
    given, worked_out = Biped.load("biped"), Biped.load(str(moved_biped(tmp_path, kp=None, kd=None)))
    np.testing.assert_allclose(worked_out.kp, given.kp, rtol=2e-3)
    np.testing.assert_allclose(worked_out.kd, given.kd, rtol=2e-3)


def test_gains_scale_with_weight_and_height(robots: dict[float, Path]) -> None:
    small, large = Biped.load(str(robots[0.5])), Biped.load(str(robots[1.5]))
    np.testing.assert_allclose(large.kp / small.kp, 3.0**4, rtol=1e-3)  # m g z
    np.testing.assert_allclose(large.kd / small.kd, 3.0**4.5, rtol=1e-3)  # and the time, √(z/g)


@pytest.mark.parametrize("size", SIZES)
def test_lengths_go_with_the_legs_and_times_with_their_square_root(size: float, robots: dict[float, Path]) -> None:
    scenario, usual = on(robots[size]), load_scenario("walking")
    gait, mpc = scenario.gait, scenario.mpc
    assert gait.stride == pytest.approx(size * usual.gait.stride, rel=1e-3)
    assert gait.swing_height == pytest.approx(size * usual.gait.swing_height, rel=1e-3)
    assert gait.tick == usual.gait.tick
    assert gait.ticks_per_step == round(usual.gait.ticks_per_step * math.sqrt(size))
    assert mpc.horizon == 2 * gait.ticks_per_step
    assert mpc.recovery is not None
    assert usual.mpc.recovery is not None
    np.testing.assert_allclose(mpc.recovery.step_reach, size * np.array(usual.mpc.recovery.step_reach), rtol=1e-3)
    np.testing.assert_allclose(gait.zmp_box, size * np.array(usual.gait.zmp_box), rtol=1e-3, atol=1e-4)
    assert mpc.stance_width_min == pytest.approx(size * usual.mpc.stance_width_min, rel=1e-3)
    margin, usual_margin = (s.barriers["forward_speed"].bound.margin for s in (scenario, usual))
    assert margin == pytest.approx(math.sqrt(size) * usual_margin, rel=0.03)  # of the whole number of ticks


def numbers(model: type[BaseModel], prefix: str) -> Iterator[str]:
    """Keys of a config that hold numbers, those of its parts included."""
    for name, field in model.model_fields.items():
        kinds = [field.annotation, *get_args(field.annotation)]
        parts = [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)]
        flat = [
            kind for k in kinds for kind in (k, *(get_args(k) if get_origin(k) in (tuple, types.UnionType) else ()))
        ]
        for part in parts:
            yield from numbers(part, f"{prefix}{name}.")
        if not parts and any(kind in (int, float) or float in get_args(kind) for kind in flat):
            yield f"{prefix}{name}"


def test_every_number_of_gait_and_controller_has_a_rule_or_none_on_purpose() -> None:
    keys = {*numbers(GaitConfig, "gait."), *numbers(MpcConfig, "mpc.")}
    assert keys == {key for key in RULES if key.startswith(("gait.", "mpc."))} | SCALE_FREE | OF_ROBOT_AND_STEP


def test_a_foothold_is_held_later_on_small_soles(tmp_path: Path) -> None:
    """Since the ZMP makes up for less of one that a late push has made wrong."""
    shares = []
    for name, sole in (("small", bipeds.narrow().sole), ("usual", bipeds.Shape().sole)):
        scenario = on(bipeds.write(tmp_path / name, dataclasses.replace(bipeds.narrow(), sole=sole)))
        assert scenario.mpc.recovery is not None
        shares.append(scenario.mpc.recovery.freeze_ticks / scenario.gait.ticks_per_step)
    small, usual = shares
    assert usual == pytest.approx(RecoveryConfig().freeze_ticks / GaitConfig().ticks_per_step, abs=0.025)
    assert 0.0 < small < 0.5 * usual


@pytest.mark.parametrize("sole", [(0.08, 0.0235), (0.12, 0.05), (0.1, 0.06), (0.08, 0.06)])
def test_a_recovery_keeps_off_the_corners_of_narrow_soles(sole: tuple[float, float], tmp_path: Path) -> None:
    """About which they turn; the gait's own box is always within that of a recovery."""
    scenario = on(bipeds.write(tmp_path, bipeds.Shape(sole=sole)))
    assert scenario.mpc.recovery is not None
    assert scenario.mpc.recovery.zmp_box is not None
    (length, width), walk = scenario.mpc.recovery.zmp_box, scenario.gait.zmp_box
    assert width == pytest.approx(2.0 * sole[1], abs=1e-4)
    assert length == pytest.approx(min(2.0 * sole[0], max(width * 0.1 / 0.06, walk[0])), abs=3e-4)


def test_given_values_are_never_scaled(robots: dict[float, Path], tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(
        f"base: {{extends: walking, robot: {robots[0.5]}, gait: {{stride: 0.06}},\n"
        "       mpc: {recovery: {noticed: 0.011}}}\n"
        "mine: {extends: base, barriers: {forward_speed: {bound: {margin: 0.04}}}}\n"
    )
    scenario, fitted = load_fitted(f"{tmp_path / 'mine.yaml'}:mine", "{gait: {swing_height: 0.03}, from_time: 2.0}")
    assert (scenario.gait.stride, scenario.gait.swing_height, scenario.from_time) == (0.06, 0.03, 2.0)
    assert scenario.mpc.recovery is not None
    assert (scenario.mpc.recovery.noticed, scenario.mpc.recovery.calm) == (0.011, 0.015)
    assert scenario.barriers["forward_speed"].bound.margin == 0.04
    assert fitted is not None
    given = {
        "gait.stride",
        "gait.swing_height",
        "from_time",
        "mpc.recovery.noticed",
        "barriers.forward_speed.bound.margin",
    }
    assert not given & set(fitted.changed)
    assert fitted.changed["mpc.recovery.calm"] == (0.03, 0.015)


def test_what_is_counted_in_ticks_follows_a_given_step(robots: dict[float, Path]) -> None:
    scenario = on(robots[0.5], "gait: {ticks_per_step: 60}")
    assert (scenario.gait.ticks_per_step, scenario.mpc.horizon, scenario.gait.double_support_ticks) == (60, 120, 6)


def test_a_scenario_with_every_value_is_read_as_it_is(robots: dict[float, Path], tmp_path: Path) -> None:
    scenario = on(robots[0.5], "gait: {stride: 0.06}")
    write_yaml(scenario.to_dict() | {"robot": "nowhere/robot.yaml"}, tmp_path / "scenario.yaml")
    read, fitted = load_fitted(str(tmp_path / "scenario.yaml"))
    assert fitted is None
    assert read.to_dict() == scenario.to_dict() | {"robot": str(tmp_path / "nowhere" / "robot.yaml")}


def test_a_tick_shrinks_where_a_step_would_have_too_few(tmp_path: Path) -> None:
    scenario = on(bipeds.write(tmp_path, bipeds.resized(0.1)))
    assert scenario.gait.tick == 0.005
    assert scenario.gait.ticks_per_step == round(0.4 * math.sqrt(0.1) / 0.005)
    assert scenario.gait.tick / scenario.plant["time_step"] == 10


def shift(scenario: Scenario) -> float:
    """How far the swing leg moves the ZMP, over half the sole's length."""
    biped, gait = Biped.load(scenario.robot), scenario.gait
    feet = (sole_pose(0.0, side * gait.stance_width / 2.0) for side in (1.0, -1.0))
    lever = swing_lever(biped, upright_posture(biped, np.array([0.0, 0.0, gait.com_height]), *feet))[0]
    swing = (gait.ticks_per_step - gait.double_support_ticks) * gait.tick
    return zmp_shift(float(lever), gait.stride, swing) / float(biped.soles["left"].half_size[0])


def test_a_short_sole_makes_the_default_step_slower(tmp_path: Path) -> None:
    shape = bipeds.Shape(sole=(0.07, 0.06))
    scenario, fitted = load_fitted("walking", f"robot: {bipeds.write(tmp_path, shape)}")
    assert scenario.gait.ticks_per_step > 40
    assert 0.55 < shift(scenario) < 0.61
    assert fitted is not None
    (reason,) = fitted.reasons
    assert re.fullmatch(r"steps of 0\.43\d s instead of 0\.4 s for the swing leg's pull on the ZMP", reason)


@pytest.mark.parametrize(
    "shape",
    [bipeds.Shape(torso=6.0, leg=1.4), bipeds.Shape(sole=(0.07, 0.06)), bipeds.narrow(), bipeds.random_shape(6)],
    ids=["heavy legs", "short soles", "narrow soles", "generated 6"],
)
def test_a_margin_grows_with_what_the_swing_leg_does_to_the_velocity(shape: bipeds.Shape, tmp_path: Path) -> None:
    """A ZMP that goes to and fro by s in a step of T drives the velocity by ω² s T, off the orbit of the bound."""
    own, ours = on(bipeds.write(tmp_path, shape)), load_scenario("walking")
    (margin, drift), (usual, usual_drift) = (
        (
            s.barriers["forward_speed"].bound.margin,
            shift(s) * float(Biped.load(s.robot).soles["left"].half_size[0])
            * s.gait.ticks_per_step * s.gait.tick / s.gait.com_height,
        )
        for s in (own, ours)
    )  # fmt: skip
    assert margin is not None
    assert usual is not None
    assert margin / usual > 0.99 * drift / usual_drift


def test_where_a_slower_step_is_not_enough_the_default_stride_is_shorter(tmp_path: Path) -> None:
    scenario = on(bipeds.write(tmp_path, bipeds.Shape(sole=(0.03, 0.06), sole_x=0.0)))
    assert (scenario.gait.ticks_per_step, scenario.gait.stride < 0.15) == (60, True)
    assert 0.5 < shift(scenario) < 0.62


@pytest.mark.parametrize(("stride", "most"), [(0.2, 0.9), (0.3, 0.9)])
def test_a_given_stride_stretches_the_step_only_where_it_must(stride: float, most: float, tmp_path: Path) -> None:
    robot = bipeds.write(tmp_path, bipeds.Shape(sole=(0.09, 0.06)))
    scenario = on(robot, f"gait: {{stride: {stride}}}")
    assert scenario.gait.stride == stride
    assert shift(scenario) < most + 0.03
    assert (scenario.gait.ticks_per_step > 40) == (stride == 0.3)
    assert on(robot, f"gait: {{stride: {stride}, ticks_per_step: 40}}").gait.ticks_per_step == 40


def test_legs_that_reach_less_far_make_a_shorter_default_stride(tmp_path: Path) -> None:
    robot = bipeds.write(tmp_path, bipeds.resized(1.0), com_height=0.62)
    scenario, fitted = load_fitted("walking", f"robot: {robot}")
    assert scenario.gait.stride < 0.1
    assert fitted is not None
    assert "for the legs' reach" in fitted.reasons[-1]


def test_slow_joints_make_a_slower_step(tmp_path: Path) -> None:
    path = bipeds.write(tmp_path, bipeds.resized(1.0))
    urdf = (tmp_path / "robot.urdf").read_text()
    (tmp_path / "robot.urdf").write_text(urdf.replace('velocity="18"', 'velocity="4.5"'))
    scenario, fitted = load_fitted("walking", f"robot: {path}")
    assert scenario.gait.ticks_per_step > 42
    assert fitted is not None
    assert "for the joints' speed" in fitted.reasons[0]


@pytest.mark.parametrize(("right", "alike"), [(1.0, True), (1.2, False)])
def test_a_robot_is_its_own_mirror_image_where_both_legs_weigh_the_same(
    right: float, alike: bool, tmp_path: Path
) -> None:
    shape = dataclasses.replace(bipeds.random_shape(4), right=right)
    scenario = on(bipeds.write(tmp_path, shape))
    biped = Biped.load(scenario.robot)
    assert is_mirrored(preview(biped, Step.of(scenario.gait)), leg_length(biped)) is alike


def test_a_stride_that_an_ankles_stop_does_not_allow_is_shortened(tmp_path: Path) -> None:
    robot = bipeds.write(tmp_path, bipeds.Shape())
    model = robot.with_suffix(".urdf")
    model.write_text(model.read_text().replace('lower="-1.3"', 'lower="-0.66"'))
    scenario, found = load_fitted("walking", f"robot: {robot}")
    biped, step = Biped.load(str(robot)), Step.of(scenario.gait)
    assert scenario.gait.stride < 0.15
    assert preview(biped, step).missed == ""
    assert "right_ankle_pitch at the limit" in preview(biped, step._replace(stride=0.15)).missed
    assert found is not None
    assert any("for the joints' stops" in reason for reason in found.reasons)


def test_the_box_is_as_long_as_the_swing_leg_makes_it_and_the_ankles_hold(tmp_path: Path) -> None:
    """And a stride beyond the robot's own makes no step faster."""
    shape = dataclasses.replace(bipeds.resized(1.06), leg=2.4)  # heavy legs, which move the ZMP far
    strong = bipeds.write(tmp_path / "strong", shape)
    weak = bipeds.write(tmp_path / "weak", shape, effort_limits=[75.0, 126.0, 151.0, 189.0, 29.0, 75.0])
    own, less, far = (
        load_scenario("walking", f"{{robot: {robot}{text}}}").gait
        for robot, text in ((strong, ""), (weak, ""), (strong, ", gait: {stride: 0.2067}"))
    )
    sole = 2.0 * 1.06 * 0.1
    assert own.zmp_box[0] == pytest.approx(SHIFT * sole, rel=0.03)
    assert less.zmp_box[0] < 0.5 * sole
    assert less.zmp_box[1] == own.zmp_box[1] == far.zmp_box[1]
    assert far.ticks_per_step >= own.ticks_per_step > 41
