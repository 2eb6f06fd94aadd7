"""What Drake does not read of a model: left out and said, written so that it is read, or refused in a sentence."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import bipeds
import pytest
from test_import_formats import as_mjcf

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.importing.given import Given
from pdhocbf_drake.importing.importer import Imported, import_robot
from pdhocbf_drake.importing.mjcf_motors import write_motors


def imported(folder: Path, text: str, name: str = "robot.urdf") -> Imported:
    (folder / "out").mkdir(parents=True)
    (folder / name).write_text(text)
    return import_robot(folder / name, folder / "out", Given(), lambda _: None)


def test_unread_tags_are_left_out_and_said_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    odd = '<safety_controller k_velocity="1"/></joint>'
    made = imported(tmp_path, bipeds.urdf(bipeds.Shape()).replace("</joint>", odd))
    assert "what Drake does not have left out: safety_controller of joint" in made.changes
    assert "safety_controller" not in (tmp_path / "out" / "model.urdf").read_text()
    assert not caplog.records


def test_unread_parts_of_mjcf(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Friction of turning, dry friction, contact with the floor, and a sensor without mass."""
    text = as_mjcf(bipeds.urdf(bipeds.Shape())).replace("<joint ", '<joint frictionloss="0.1" ')
    text = text.replace('type="sphere"', 'type="sphere" friction="0.9 0.01 0.01"')
    pair = '<contact><pair geom1="toe" geom2="floor"/></contact></mujoco>'
    text = text.replace("</mujoco>", pair).replace('<geom type="sphere"', '<geom name="toe" type="sphere"', 1)
    sensor = '<body name="imu"><inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/></body><body name="left_hip_yaw'
    made = imported(tmp_path, text.replace('<body name="left_hip_yaw', sensor), "robot.xml")
    assert made.biped.mass == pytest.approx(29.0)
    assert "what Drake does not have left out: frictionloss of joint" in made.changes
    assert not caplog.records


def test_torques_by_actuators_and_classes(tmp_path: Path) -> None:
    """As many MJCF files have it: the class of a joint or of its actuator says how much it can."""
    root = ET.fromstring(as_mjcf(bipeds.urdf(bipeds.Shape())))
    root.insert(0, default := ET.Element("default"))
    actuators = ET.SubElement(root, "actuator")
    for joint in list(root.iter("joint")):
        role = joint.get("name", "").partition("_")[2]
        if default.find(f"default[@class='{role}']") is None:
            ET.SubElement(default, "default", {"class": role})
            inside = default.find(f"default[@class='{role}']")
            assert inside is not None
            ET.SubElement(inside, "position", forcerange=joint.get("actuatorfrcrange", ""))
        del joint.attrib["actuatorfrcrange"]
        ET.SubElement(actuators, "position", {"class": role, "joint": joint.get("name", ""), "kp": "50"})
    made = imported(tmp_path, ET.tostring(root, encoding="unicode"), "robot.xml")
    assert made.biped.effort_limits.tolist() == pytest.approx([60.0, 100.0, 120.0, 150.0, 80.0, 60.0] * 2)


def test_the_least_of_what_joint_and_actuators_can() -> None:
    root = ET.fromstring(
        '<mujoco><default><joint actuatorfrcrange="-9 9"/><default class="a"><motor ctrlrange="-3 4" gear="2"/>'
        '<joint actuatorfrcrange="-50 50"/></default></default><worldbody><body childclass="a"><joint name="p"/>'
        '<body><joint name="q" class="main"/><joint name="r" actuatorfrcrange="-1 1"/><joint name="s"/></body></body>'
        '</worldbody><actuator><motor joint="p" class="a"/><general joint="s" forcerange="-7 7"/></actuator></mujoco>'
    )
    write_motors(root)
    motors = {motor.get("joint"): motor.get("forcerange") for motor in root.iter("motor") if motor.get("forcerange")}
    assert motors == {"p": "-8 8", "q": "-9 9", "r": "-1 1", "s": "-7 7"}


def test_loops_of_joints_are_one_sentence(tmp_path: Path) -> None:
    rod = (
        '<joint name="rod" type="revolute"><parent link="torso"/><child link="left_foot"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    with pytest.raises(ModelError) as caught:
        imported(tmp_path, bipeds.urdf(bipeds.Shape()).replace("</robot>", rod))
    assert str(caught.value) == (
        f"{tmp_path / 'robot.urdf'} can't be read: its joints form loops, and those of a robot that walks form a tree: "
        "'left_foot' hangs from left_ankle_roll, rod"
    )
