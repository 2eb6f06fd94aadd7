"""Messages about a robot or a walk that can't be used: one sentence with the value given and the existing ones."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import bipeds
import numpy as np
import pytest
from biped_cases import biped, standing
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import DiagramBuilder

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError, ModelError
from pdhocbf_drake.robot import Biped, RobotConfig, check_walk, load_robot_config, models_folder, upright_posture

FOLDER = models_folder() / "biped"
LINKS = ("hip_yaw", "hip_roll", "thigh", "shank", "ankle", "foot")
WALK: dict[str, Any] = dict(stride=0.15, stance_width=0.16, com_height=0.58, amplitude=0.01, zmp_box=(0.1, 0.1))


def changed(**update: Any) -> RobotConfig:
    """The biped's config with some entries replaced."""
    data = load_robot_config("biped").model_dump()
    for path, value in update.items():
        *parents, last = path.split("__")
        entry = data
        for parent in parents:
            entry = entry[parent]
        entry[last] = value
    return parse_config(RobotConfig, data, "robot")


def edited(tmp_path: Path, *remove: str, add: str = "") -> str:
    """Path of a copy of the URDF without some tags and with some XML added."""
    robot = ET.parse(FOLDER / "biped.urdf").getroot()
    for tag in remove:
        for element in robot.findall(tag):
            robot.remove(element)
    robot.extend(ET.fromstring(f"<robot>{add}</robot>"))
    path = tmp_path / "edited.urdf"
    ET.ElementTree(robot).write(path)
    return str(path)


ARM = """<link name="arm"><inertial><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="torso"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="10" velocity="10"/></joint>"""


def text_of(config: RobotConfig) -> str:
    with pytest.raises(ModelError) as caught:
        Biped(config)
    return str(caught.value)


def test_unknown_robot() -> None:
    with pytest.raises(ModelError) as caught:
        Biped.load("bibed")
    assert str(caught.value) == "no robot 'bibed': give the path of a robot YAML file, or one of: biped"


def test_missing_model_file() -> None:
    gone = str(FOLDER / "gone.urdf")
    assert text_of(changed(model=gone)) == (
        f"robot 'biped': no model file {gone}; model files in that folder: biped.urdf"
    )


def test_unreadable_model_file(tmp_path: Path) -> None:
    path = tmp_path / "broken.urdf"
    path.write_text("<robot name='x'><link></robot>")
    assert text_of(changed(model=str(path))).startswith(f"robot 'biped': {path} can't be read: ")


def test_missing_joint_lists_those_there_are() -> None:
    roles = ("hip_yaw", "hip_roll", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_roll")
    there = ", ".join(sorted(f"{side}_{role}" for side in ("left", "right") for role in roles))
    assert text_of(changed(left__joints__knee_pitch="left_knee")) == (
        f"robot 'biped' has no joint 'left_knee'; its moving joints are: {there}"
    )


def test_missing_frame_lists_those_there_are() -> None:
    links = sorted(["torso", *(f"{side}_{link}" for side in ("left", "right") for link in LINKS)])
    assert text_of(changed(left__sole__link="left_toes")) == (
        f"robot 'biped' has no link or frame 'left_toes'; there are: {', '.join(links)}"
    )


def test_without_actuators_the_models_limits_hold(tmp_path: Path) -> None:
    robot = Biped(changed(model=edited(tmp_path, "transmission"), reflected_inertia=0.01))
    assert robot.effort_limits.tolist() == biped().effort_limits.tolist()
    assert robot.plant.num_actuators() == 12


def test_no_effort_anywhere(tmp_path: Path) -> None:
    path = edited(tmp_path, "transmission")
    text = Path(path).read_text().replace('effort="60"', 'effort="0"')
    Path(path).write_text(text)
    assert text_of(changed(model=path)) == (
        "robot 'biped' has no actuators, and joint 'left_hip_yaw' has no effort in its <limit>: "
        f"add it to {path} or give effort_limits [N m] in the robot file"
    )
    limits = (60.0, 100.0, 120.0, 150.0, 80.0, 60.0)
    robot = Biped(changed(model=path, effort_limits=limits))
    assert robot.effort_limits.tolist() == [*limits, *limits]


def test_values_of_each_side() -> None:
    sides = {"left": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "right": 7.0}
    robot = Biped(changed(effort_limits=sides, kp={"left": 500.0, "right": [8.0] * 6}))
    assert robot.effort_limits.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0] + [7.0] * 6
    assert robot.kp.tolist() == [500.0] * 6 + [8.0] * 6


def test_joints_beyond_the_legs_are_named_and_can_be_fixed(tmp_path: Path) -> None:
    path = edited(tmp_path, add=ARM)
    assert text_of(changed(model=path)) == (
        "robot 'biped' has moving joints beyond the twelve of its legs: shoulder; give each an angle in fixed_joints"
    )
    robot = Biped(changed(model=path, fixed_joints={"shoulder": 0.3}))
    assert robot.mass == pytest.approx(30.0)
    posture = standing()
    upright_posture(robot, posture.com, posture.left, posture.right)


def test_fixed_joint_keeps_its_angle(tmp_path: Path) -> None:
    robot = Biped(changed(model=edited(tmp_path, add=ARM), fixed_joints={"shoulder": 0.3}))
    pose = robot.plant.GetFrameByName("arm").CalcPose(
        robot.plant.CreateDefaultContext(), robot.plant.GetFrameByName("torso")
    )
    assert pose.rotation().ToRollPitchYaw().pitch_angle() == pytest.approx(0.3)


def with_arm(tmp_path: Path, old: str, new: str, **update: Any) -> RobotConfig:
    """The biped with an arm whose text is changed."""
    return changed(model=edited(tmp_path, add=ARM.replace(old, new)), **update)


def test_a_prismatic_joint_can_be_fixed_at_a_length(tmp_path: Path) -> None:
    robot = Biped(with_arm(tmp_path, "revolute", "prismatic", fixed_joints={"shoulder": 0.25}))
    pose = robot.plant.GetFrameByName("arm").CalcPose(
        robot.plant.CreateDefaultContext(), robot.plant.GetFrameByName("torso")
    )
    assert pose.translation().tolist() == pytest.approx([0.0, 0.25, 0.0])


def test_a_joint_that_the_model_fixes_may_be_listed_too(tmp_path: Path) -> None:
    assert Biped(with_arm(tmp_path, "revolute", "fixed", fixed_joints={"shoulder": 0.0})).mass == pytest.approx(30.0)
    assert text_of(with_arm(tmp_path, "revolute", "fixed", fixed_joints={"shoulder": 0.2})) == (
        "robot 'biped': fixed_joints may hold revolute or prismatic joints, 'shoulder' is of type 'weld'; "
        "a joint that the model fixes may stand there with 0 alone"
    )


def test_a_fixed_joint_may_follow_another_one(tmp_path: Path) -> None:
    config = with_arm(tmp_path, "</joint>", '<mimic joint="left_knee_pitch"/></joint>', fixed_joints={"shoulder": 0.3})
    assert Biped(config).plant.num_constraints() == 0


def test_a_joint_of_a_leg_may_not_follow_another_one(tmp_path: Path) -> None:
    path = Path(edited(tmp_path))
    text = path.read_text()
    joint = '<joint name="right_knee_pitch" type="revolute">'
    path.write_text(text.replace(joint, joint + '<mimic joint="left_knee_pitch" multiplier="1"/>'))
    assert text_of(changed(model=str(path))) == (
        "robot 'biped': joint 'right_knee_pitch' of a leg follows 'left_knee_pitch' in the model (mimic), "
        "but each joint of a leg needs a motor of its own"
    )


def test_limits_in_the_wrong_order(tmp_path: Path) -> None:
    path = Path(edited(tmp_path))
    path.write_text(path.read_text().replace('lower="-0.4" upper="0.7"', 'lower="0.7" upper="-0.4"'))
    assert text_of(changed(model=str(path))) == (
        f"robot 'biped': {path} can't be read: "
        "joint 'left_hip_roll' has a lower limit of 0.7 above its upper one of -0.4"
    )


def test_one_joint_for_two_roles() -> None:
    with pytest.raises(InputError) as caught:
        changed(left__joints__hip_roll="left_hip_yaw")
    assert str(caught.value) == (
        "robot: joint 'left_hip_yaw' is named for left.joints.hip_yaw and left.joints.hip_roll; "
        "each has a joint of its own"
    )


def test_a_joint_that_moves_and_is_fixed() -> None:
    with pytest.raises(InputError, match=r"robot: joint 'left_hip_yaw' is in fixed_joints, and a joint of a leg too"):
        changed(fixed_joints={"left_hip_yaw": 0.0})


def test_meshes_in_formats_that_drake_does_not_read(tmp_path: Path) -> None:
    path = bipeds.write(tmp_path, bipeds.Shape())
    urdf, mesh = tmp_path / "robot.urdf", '<collision><geometry><mesh filename="shell.stl"/></geometry></collision>'
    urdf.write_text(urdf.read_text().replace("</link>", f"{mesh}</link>", 1))
    (tmp_path / "shell.stl").write_text("solid shell\nendsolid shell\n")
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(), DiagramBuilder())
    with pytest.raises(ModelError, match=r"OBJ, glTF and VTK; `pdhocbf import` converts others$"):
        Biped.load(str(path)).add_to(plant)


def test_a_warning_of_drake_is_logged_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    config = with_arm(tmp_path, "</joint>", '<dynamics friction="1"/></joint>', fixed_joints={"shoulder": 0.0})
    for _ in range(3):
        Biped(config)
    assert len([record for record in caplog.records if "friction" in record.getMessage()]) == 1


def test_a_torso_whose_own_x_points_backwards(tmp_path: Path) -> None:
    shape = bipeds.Shape(base_rpy=(0.0, 0.0, np.pi))
    plain = Biped.load(str(bipeds.write(tmp_path / "plain", bipeds.Shape())))
    turned = Biped.load(str(bipeds.write(tmp_path / "turned", shape, torso_rpy=[0.0, 0.0, np.pi])))
    posture = standing()
    first, other = (upright_posture(robot, posture.com, posture.left, posture.right) for robot in (plain, turned))
    np.testing.assert_allclose(other[turned.q_index], first[plain.q_index], atol=1e-6)


def test_base_that_does_not_float() -> None:
    assert text_of(changed(base_link="pelvis")) == (
        "robot 'biped': base_link 'pelvis' must be the one floating link; floating are: torso"
    )


def test_unknown_key_in_the_robot_file(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text((FOLDER / "biped.yaml").read_text() + "legs: 2\n")
    with pytest.raises(InputError, match=r"robot\.yaml\.legs: unknown key; allowed here: base_link, com_height, "):
        Biped.load(str(path))


@pytest.mark.parametrize(
    ("update", "says"),
    [
        ({"kp": -600.0}, "robot.kp: must be above 0 and up to 1e+06 N m/rad (given: -600.0)"),
        ({"kp": 1e12}, "robot.kp: must be above 0 and up to 1e+06 N m/rad"),
        ({"kp": [1.0] * 5}, "robot.kp: must be one number for all joints, or six: hip_yaw, hip_roll, hip_pitch, "),
        ({"kp": {"left": 1.0}}, "robot.kp: must be one number for all joints, or six: hip_yaw, hip_roll, hip_pitch, "),
        ({"kd": [1.0] * 5 + [-1.0]}, "robot.kd: must be from 0 to 100000 N m s/rad"),
        ({"effort_limits": 0}, "robot.effort_limits: must be above 0"),
        ({"reflected_inertia": -1}, "robot.reflected_inertia: must be from 0 to 1000 kg m²"),
        ({"left__bent_knee__knee_pitch": 45.0}, "left.bent_knee.knee_pitch: must be from -3.14159 to 3.14159 rad"),
        ({"left__sole__half_size": [100.0, 60.0]}, "left.sole.half_size.0: must be above 0 and up to 1 m (given: 100"),
        ({"left__sole__half_size": [-0.1, 0.06]}, "left.sole.half_size.0: must be above 0 and up to 1 m (given: -0.1)"),
        ({"com_height": 580.0}, "robot.com_height: must be above 0 and up to 10 m (given: 580.0)"),
        ({"stance_width": 160.0}, "robot.stance_width: must be above 0 and up to 10 m (given: 160.0)"),
    ],
)
def test_numbers_that_no_robot_has(update: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError) as caught:
        changed(**update)
    assert says in str(caught.value)


def test_legs_that_are_swapped() -> None:
    config = load_robot_config("biped")
    message = text_of(config.model_copy(update={"left": config.right, "right": config.left}))
    assert message.startswith(
        "robot 'biped': left, right: left and right are exchanged: the left sole is at y = -0.08 m"
    )


def test_a_package_folder_that_is_not_there() -> None:
    assert text_of(changed(packages={"pdhocbf_models": "/nope"})) == (
        "robot 'biped': packages.pdhocbf_models: there is no folder /nope"
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", r"robot\.yaml holds nothing; see models/biped/biped\.yaml"),
        ("kp: 1\nkp: 2\n", r"robot\.yaml is not valid YAML at line 2, column 1: key 'kp' is given twice"),
        ("a: {b", r"robot\.yaml is not valid YAML at line 1, column 6"),
    ],
)
def test_a_robot_file_is_read_like_a_scenario(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(text)
    with pytest.raises(InputError, match=says) as caught:
        Biped.load(str(tmp_path / "robot.yaml"))
    assert "\n" not in str(caught.value)


def refused(**update: Any) -> str:
    with pytest.raises(ModelError) as caught:
        check_walk(biped(), **{**WALK, **update})
    return str(caught.value)


def test_walks_within_reach_are_accepted() -> None:
    for stride in (0.0, 0.15, 0.2, -0.2):
        check_walk(biped(), **{**WALK, "stride": stride})


def test_com_height_out_of_reach_with_the_number_that_was_given() -> None:
    assert refused(com_height=0.74) == (
        "gait.com_height: the CoM at 0.74 m (0.73 to 0.75 m with its amplitude) is out of reach of robot 'biped' with "
        "its feet 0.16 m apart; allowed is 0.33 to 0.62 m"
    )
    assert "the CoM at 0.74 m is out of reach" in refused(com_height=0.74, amplitude=0.0)
    assert refused(amplitude=0.3).startswith("gait.com_height_amplitude: the CoM at 0.58 m (0.28 to 0.88 m")


def test_allowed_heights_and_strides_are_accepted() -> None:
    for height in map(float, re.findall(r"allowed is (\S+) to (\S+) m", refused(com_height=0.74))[0]):
        check_walk(biped(), **{**WALK, "stride": 0.0, "com_height": height})
    check_walk(biped(), **{**WALK, "stride": float(re.findall(r"up to (\S+) m$", refused(stride=0.9))[0])})


@pytest.mark.parametrize(("key", "value"), [("com_height", 0.74), ("stance_width", 0.05), ("stance_width", 2.0)])
def test_a_value_of_the_robot_s_file_is_named_as_such(key: str, value: float) -> None:
    own = Biped(changed(**{key: value}))
    with pytest.raises(ModelError, match=f"^gait.{key}, by default {key} of the robot's file: .* {value:g} m"):
        check_walk(own, **{**WALK, key: value})


def test_stride_beyond_the_legs() -> None:
    assert refused(stride=0.9) == (
        "gait.stride: a step of 0.9 m is beyond the legs' reach of robot 'biped' with the CoM at 0.58 m (0.57 to "
        "0.59 m with its amplitude); allowed is up to 0.461 m"
    )


def test_zmp_box_larger_than_the_sole() -> None:
    assert refused(zmp_box=(0.1, 0.13)) == (
        "gait.zmp_box: a ZMP box of 0.1 x 0.13 m is larger than the sole of robot 'biped'; "
        "allowed is up to 0.2 x 0.12 m"
    )


def test_posture_out_of_reach() -> None:
    target = standing(0.8)
    with pytest.raises(
        ModelError, match=r"robot 'biped' can't stand with CoM \[0\.02, 0\.0, 0\.8\] and soles at .*CoM z"
    ):
        upright_posture(biped(), target.com, target.left, target.right)
