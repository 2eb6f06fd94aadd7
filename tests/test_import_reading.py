"""Robots read from their models: legs, roles, facing, soles, heights; and what is no biped, in a sentence."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import bipeds
import numpy as np
import pytest
import yaml

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.fitting.preview import Step, preview
from pdhocbf_drake.importing.given import Given
from pdhocbf_drake.importing.importer import ROBOT, SCENARIO, Imported, import_robot
from pdhocbf_drake.robot import SIDES, Biped, load_robot_config, longest_stride, models_folder
from pdhocbf_drake.robot.reach import reaches
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

EVEN = {"left": (1,) * 6, "right": (1,) * 6}


def imported(folder: Path, urdf: str, **given: Any) -> Imported:
    """The import of a model with that text into the folder `out` beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "out").mkdir()
    (folder / "some.urdf").write_text(urdf)
    return import_robot(folder / "some.urdf", folder / "out", Given(**given), lambda _: None)


def entries(folder: Path) -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load((folder / "out" / ROBOT).read_text())
    return data


def refused(folder: Path, urdf: str, **given: Any) -> str:
    with pytest.raises(ModelError) as caught:
        imported(folder, urdf, **given)
    return str(caught.value)


def meaningless(urdf: str) -> str:
    """The model with names that say nothing."""
    names = sorted(set(re.findall(r'name="((?:left|right)_\w+)"', urdf)), key=len, reverse=True)
    for number, name in enumerate(names):
        urdf = urdf.replace(f'"{name}"', f'"x{number}"')
    return urdf


@pytest.fixture(scope="module")
def packaged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("packaged")
    import_robot(models_folder() / "biped" / "biped.urdf", folder, Given(), lambda _: None)
    return folder


def test_the_packaged_biped_gives_back_its_file(packaged: Path) -> None:
    own, read = load_robot_config("biped"), load_robot_config(str(packaged / ROBOT))
    different = {"model", "packages", "keep_contact", "kp", "kd"}
    assert read.model_dump(exclude=different) == own.model_dump(exclude=different)
    robot = Biped(read)
    assert robot.kp == pytest.approx(Biped(own).kp, rel=2e-3)
    assert robot.kd == pytest.approx(Biped(own).kd, rel=5e-3)


def test_the_packaged_biped_walks_as_it_does(packaged: Path) -> None:
    gains = load_robot_config(str(packaged / ROBOT)).model_dump(exclude={"kp", "kd"}) | {"kp": 600.0, "kd": 20.0}
    (packaged.parent / "same.yaml").write_text(yaml.safe_dump(yaml.safe_load(_json(gains))))
    own = simulate(load_scenario("walking", "duration: 1.6"))
    other = simulate(load_scenario("walking", f"{{duration: 1.6, robot: {packaged.parent / 'same.yaml'}}}"))
    np.testing.assert_allclose(other["robot_state"], own["robot_state"], atol=1e-6)


def _json(data: Any) -> str:
    import json

    return json.dumps(data)


def test_the_scenario_needs_nothing_more(packaged: Path) -> None:
    assert yaml.safe_load((packaged / SCENARIO).read_text()) == {
        "name": "biped-walking",
        "extends": "walking",
        "robot": ROBOT,
    }
    assert load_scenario(str(packaged / SCENARIO)).gait.stride == 0.15


def test_a_copy_is_a_model_to_import(packaged: Path, tmp_path: Path) -> None:
    import_robot(packaged / "model.urdf", tmp_path, Given(), lambda _: None)
    assert yaml.safe_load((tmp_path / ROBOT).read_text()) == yaml.safe_load((packaged / ROBOT).read_text())


@pytest.mark.parametrize("seed", range(6))
def test_random_bipeds_are_read_rightly(tmp_path: Path, seed: int) -> None:
    shape = bipeds.random_shape(seed)
    imported(tmp_path, bipeds.urdf(shape))
    read, true = entries(tmp_path), bipeds.robot(shape)
    for side in SIDES:
        assert read[side]["joints"] == true[side]["joints"]
        assert read[side]["bent_knee"] == pytest.approx(true[side]["bent_knee"])
        sole, wanted = read[side]["sole"], true[side]["sole"]
        assert sole["link"] == wanted["link"]
        assert sole["xyz"] == pytest.approx(wanted["xyz"], abs=2e-4)
        short = np.array(wanted["half_size"]) - sole["half_size"]
        assert short.min() > -1e-6
        assert short.max() <= 6e-4
    assert read["com_height"] == pytest.approx(true["com_height"], rel=0.03)


@pytest.mark.parametrize(("hip", "width"), [(0.14, 0.28), (0.24, 0.3)])
def test_the_feet_are_no_further_apart_than_half_a_leg(hip: float, width: float, tmp_path: Path) -> None:
    imported(tmp_path, bipeds.urdf(replace(bipeds.Shape(), hip=hip)))
    assert entries(tmp_path)["stance_width"] == pytest.approx(width)


def test_names_do_not_matter(tmp_path: Path) -> None:
    shape = bipeds.random_shape(3)
    imported(tmp_path / "named", bipeds.urdf(shape))
    imported(tmp_path / "other", meaningless(bipeds.urdf(shape)))
    named, other = entries(tmp_path / "named"), entries(tmp_path / "other")
    for side in SIDES:
        assert other[side]["joints"] != named[side]["joints"]
        assert other[side]["bent_knee"] == named[side]["bent_knee"]
        assert other[side]["sole"]["xyz"] == named[side]["sole"]["xyz"]
    assert other["com_height"] == named["com_height"]


@pytest.mark.parametrize("yaw", [np.pi, np.pi / 2, -np.pi / 2])
def test_forward_is_where_the_knees_bend_to(tmp_path: Path, yaw: float) -> None:
    made = imported(tmp_path, bipeds.urdf(bipeds.Shape(base_rpy=(0.0, 0.0, yaw))))
    read, straight = entries(tmp_path), bipeds.robot(bipeds.Shape())
    assert read["torso_rpy"] == pytest.approx([0.0, 0.0, yaw], abs=1e-6)
    assert {side: read[side]["joints"] for side in SIDES} == {side: straight[side]["joints"] for side in SIDES}
    fact = next(fact for fact in made.facts if fact.what == "ahead")
    assert (fact.source, fact.sure) == ("the way the knees bend", "certain")


@pytest.mark.parametrize("up", ["x", None])
def test_a_base_whose_z_is_not_up(tmp_path: Path, up: str | None) -> None:
    made = imported(tmp_path, bipeds.urdf(bipeds.Shape(base_rpy=(0.0, np.pi / 2, 0.0))), up=up)
    assert entries(tmp_path)["torso_rpy"] == pytest.approx([0.0, np.pi / 2, 0.0], abs=1e-6)
    fact = next(fact for fact in made.facts if fact.what == "up")
    assert (fact.value, fact.sure) == ("x of the base", "given" if up else "likely")


def test_a_base_of_any_orientation(tmp_path: Path) -> None:
    made = imported(tmp_path, bipeds.urdf(bipeds.Shape(base_rpy=(0.4, 1.0, -2.0))))
    assert entries(tmp_path)["torso_rpy"] == pytest.approx([0.4, 1.0, -2.0], abs=1e-6)
    assert next(fact for fact in made.facts if fact.what == "up").sure == "likely"


def test_knees_that_bend_both_ways_need_a_flag(tmp_path: Path) -> None:
    urdf = bipeds.urdf(replace(bipeds.Shape(), sole_x=0.0))
    for limits in ('lower="0.0" upper="2.4"', 'lower="-2.4" upper="0.0"'):
        urdf = urdf.replace(limits, 'lower="-2.4" upper="2.4"')
    assert refused(tmp_path / "a", urdf).endswith("give --forward with x or -x, an axis of the base")
    for number, forward in enumerate(("x", "-x")):
        made = imported(tmp_path / str(number), urdf, forward=forward)
        sign = 1.0 if forward == "x" else -1.0
        read = entries(tmp_path / str(number))
        assert read["left"]["joints"]["knee_pitch"] == f"{'left' if sign > 0 else 'right'}_knee_pitch"
        assert next(fact for fact in made.facts if fact.what == "ahead").sure == "given"
    assert refused(tmp_path / "b", urdf, forward="y") == (
        "--forward y is not across the line between the feet; x or -x is"
    )


def joint(urdf: str, name: str, kind: str = "fixed") -> str:
    return urdf.replace(f'name="{name}" type="revolute"', f'name="{name}" type="{kind}"')


def test_five_joints_a_leg(tmp_path: Path) -> None:
    urdf = bipeds.urdf(bipeds.Shape())
    for side in SIDES:
        urdf = joint(urdf, f"{side}_ankle_roll")
    text = refused(tmp_path, urdf)
    assert text.startswith("a leg has six revolute joints, but the one to ")
    assert "has 5: left_hip_yaw [0 0 1], left_hip_roll [1 0 0], left_hip_pitch [0 1 0], left_knee_pitch [0 1 0]" in text


def test_arms_are_no_legs(tmp_path: Path) -> None:
    """Five joints each, on a body that reaches far below where they begin."""
    urdf = joint(bipeds.urdf(bipeds.Shape()), "left_hip_yaw")
    body = '<visual><origin xyz="0 0 -0.3"/><geometry><box size="0.1 0.1 0.4"/></geometry></visual>'
    text = refused(tmp_path, urdf.replace('<link name="torso">', f'<link name="torso">{body}', 1))
    assert text.startswith("no legs were found: the limbs that reach lowest, to ")


def limb(name: str, parent: str, xyz: str, axis: str = "0 1 0", geometry: bool = True) -> str:
    """A link that hangs from another one by a joint."""
    shape = '<collision><origin xyz="0 0 -0.3"/><geometry><box size="0.1 0.1 0.6"/></geometry></collision>'
    return (
        f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" '
        f'iyz="0"/></inertial>{shape if geometry else ""}</link><joint name="{name}_joint" type="revolute">'
        f'<parent link="{parent}"/><child link="{name}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/>'
        '<limit lower="-1" upper="1" effort="10" velocity="10"/></joint></robot>'
    )


def test_four_legs(tmp_path: Path) -> None:
    urdf = bipeds.urdf(bipeds.Shape())
    for name, y in (("front_left", 0.1), ("front_right", -0.1)):
        urdf = urdf.replace("</robot>", limb(name, "torso", f"0.5 {y} -0.055"))
    assert refused(tmp_path, urdf) == (
        "4 limbs stand on the ground, and a biped has two: front_left, front_right, left_foot, right_foot; "
        "name its feet with --left-foot and --right-foot"
    )


def test_one_leg(tmp_path: Path) -> None:
    urdf = bipeds.urdf(bipeds.Shape())
    right = urdf.index('<link name="right_')
    assert refused(tmp_path, urdf[:right] + "</robot>") == (
        "1 limb stands on the ground, and a biped has two: left_foot; name its feet with --left-foot and --right-foot"
    )


def test_feet_that_are_named(tmp_path: Path) -> None:
    urdf = bipeds.urdf(bipeds.Shape())
    for name, y in (("wheel_left", 0.1), ("wheel_right", -0.1)):
        urdf = urdf.replace("</robot>", limb(name, "torso", f"0.5 {y} -0.055"))
    imported(tmp_path, urdf, left_foot="left_foot", right_foot="right_foot")
    assert entries(tmp_path)["fixed_joints"] == {"wheel_left_joint": 0.0, "wheel_right_joint": 0.0}
    assert refused(tmp_path / "b", urdf, left_foot="shoe", right_foot="right_foot").startswith(
        "the model has no link 'shoe'; there are: left_ankle_pitch_link, "
    )


def test_arms_waist_and_toes_are_fixed(tmp_path: Path) -> None:
    urdf = bipeds.urdf(bipeds.Shape()).replace("</robot>", limb("arm", "torso", "0 0.2 0.4"))
    for side in SIDES:
        urdf = urdf.replace("</robot>", limb(f"{side}_toe", f"{side}_foot", "0.1 0 -0.04", geometry=False))
    imported(tmp_path, urdf, fixed={"arm_joint": 0.3})
    read = entries(tmp_path)
    assert read["fixed_joints"] == {"arm_joint": 0.3, "left_toe_joint": 0.0, "right_toe_joint": 0.0}
    assert read["left"]["joints"] == bipeds.robot(bipeds.Shape())["left"]["joints"]
    assert refused(tmp_path / "b", urdf, fixed={"neck": 0.3}) == (
        "there is no joint 'neck' to fix; beyond the legs there are: arm_joint, left_toe_joint, right_toe_joint"
    )


def test_a_base_above_the_waist(tmp_path: Path) -> None:
    """The legs hang from a pelvis that a joint connects to the floating chest."""
    urdf = bipeds.urdf(bipeds.Shape()).replace('parent link="torso"', 'parent link="pelvis"')
    made = imported(tmp_path, urdf.replace("</robot>", limb("pelvis", "torso", "0 0 0", "0 0 1", geometry=False)))
    assert entries(tmp_path)["fixed_joints"] == {"pelvis_joint": 0.0}
    assert next(fact for fact in made.facts if fact.what == "waist").value == "pelvis_joint"


def test_no_mass(tmp_path: Path) -> None:
    urdf = re.sub(r"<inertial>.*?</inertial>", "", bipeds.urdf(bipeds.Shape()))
    assert refused(tmp_path, urdf).endswith("has no mass: its links need <inertial> tags")


def test_no_foot_geometry(tmp_path: Path) -> None:
    urdf = re.sub(r"<collision .*?</collision>", "", bipeds.urdf(bipeds.Shape()))
    assert refused(tmp_path, urdf).startswith("the model has no foot geometry: nothing of ")


FIXED = '<link name="ground"/><joint name="stand" type="fixed"><parent link="{}"/><child link="torso"/></joint></robot>'


def test_a_fixed_base(tmp_path: Path) -> None:
    urdf = bipeds.urdf(bipeds.Shape()).replace("</robot>", FIXED.format("world").replace('<link name="ground"/>', ""))
    assert refused(tmp_path / "a", urdf) == (
        "the base of the model is fixed to the world, and that of a walking robot floats: "
        "give --base with the link that is to float; fixed is torso"
    )
    made = imported(tmp_path / "b", urdf, base="torso")
    assert "joint stand removed, so that torso floats" in made.changes


def test_a_leg_whose_joint_follows_another(tmp_path: Path) -> None:
    knee = '<joint name="right_knee_pitch" type="revolute">'
    urdf = bipeds.urdf(bipeds.Shape()).replace(knee, f'{knee}<mimic joint="left_knee_pitch"/>')
    assert refused(tmp_path, urdf) == (
        "joint 'right_knee_pitch' of a leg follows 'left_knee_pitch' in the model (mimic), but each joint of a leg "
        "needs a motor of its own"
    )


def test_weak_knees_are_straighter(tmp_path: Path) -> None:
    """A knee that could not hold a step in place, bent as usual, is imported at a height at which it can."""
    urdf = bipeds.urdf(bipeds.Shape())
    strong, weak = (
        imported(tmp_path / effort, urdf.replace('effort="150"', f'effort="{effort}"')).biped
        for effort in ("150", "38")
    )
    assert weak.config.com_height > strong.config.com_height + 0.01
    for height, carries in ((strong.config.com_height, False), (weak.config.com_height, True)):
        step = Step(0.0, weak.config.stance_width, height, 0.05, 0.4, 0.36)
        assert bool((preview(weak, step).torques <= 0.9 * weak.effort_limits).all()) == carries


def test_no_step_up_to_the_longest_is_out_of_reach(tmp_path: Path) -> None:
    """Low down, an ankle that soon comes to its stop allows short steps and long ones, and none between."""
    urdf = bipeds.urdf(bipeds.Shape()).replace('lower="-1.3"', 'lower="-0.6"')
    path = bipeds.write(tmp_path, bipeds.Shape())
    (tmp_path / "robot.urdf").write_text(urdf)
    biped = Biped.load(str(path))
    assert reaches(biped, 0.58, 0.16, 0.5)
    assert not reaches(biped, 0.58, 0.16, 0.3)
    for height in (0.567, 0.58, 0.6):
        longest = longest_stride(biped, 0.16, height)
        assert all(reaches(biped, height, 0.16, part * longest) for part in np.linspace(0.0, 1.0, 21))


def test_joints_without_torque_need_a_flag(tmp_path: Path) -> None:
    urdf = bipeds.urdf(bipeds.Shape()).replace('effort="150"', 'effort="0"')
    assert refused(tmp_path / "a", urdf) == (
        "the model says no greatest torque of left_knee_pitch, right_knee_pitch: give --effort with one for those [N m]"
    )
    made = imported(tmp_path / "b", urdf, effort=90.0)
    assert made.biped.effort_limits.tolist() == [60.0, 100.0, 120.0, 90.0, 80.0, 60.0] * 2


def test_roles_can_be_given(tmp_path: Path) -> None:
    shape = bipeds.Shape()
    names = {side: [f"{side}_{role}" for role in bipeds.ROLES] for side in SIDES}
    made = imported(tmp_path, bipeds.urdf(shape), left_joints=names["left"], right_joints=names["right"])
    assert entries(tmp_path)["left"]["joints"] == bipeds.robot(shape)["left"]["joints"]
    assert next(fact for fact in made.facts if fact.what == "left leg").sure == "given"
    wrong = ["shoulder", *names["left"][1:]]
    assert refused(tmp_path / "b", bipeds.urdf(shape), left_joints=wrong, right_joints=names["right"]).startswith(
        "six joints are needed, hip_yaw, hip_roll, hip_pitch, knee_pitch, ankle_pitch, ankle_roll; given: shoulder, "
    )
