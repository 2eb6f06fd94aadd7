"""The same biped as URDF, SDF and MJCF is read alike."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import bipeds
import pytest
import yaml
from pydrake.math import RollPitchYaw

from pdhocbf_drake.importing.given import Given
from pdhocbf_drake.importing.importer import ROBOT, import_robot


def tree_of(urdf: str) -> tuple[ET.Element, dict[str, list[ET.Element]]]:
    """The URDF, and its joints by their parent link."""
    root = ET.fromstring(urdf)
    children: dict[str, list[ET.Element]] = {}
    for joint in root.findall("joint"):
        children.setdefault(attribute(joint, "parent", "link"), []).append(joint)
    return root, children


def attribute(element: ET.Element, tag: str, name: str) -> str:
    found = element.find(tag)
    return "" if found is None else found.get(name, "0 0 0")


def turned(joint: ET.Element) -> str:
    """The orientation of a joint's frame as a quaternion."""
    angles = [float(word) for word in attribute(joint, "origin", "rpy").split()]
    return " ".join(f"{x:.12g}" for x in RollPitchYaw(angles).ToQuaternion().wxyz())


def as_mjcf(urdf: str) -> str:
    """MuJoCo's format, with torques at the joints and without motors, as many such files are."""
    root, children = tree_of(urdf)

    def body(link: ET.Element, joint: ET.Element | None) -> ET.Element:
        place = {} if joint is None else {"pos": attribute(joint, "origin", "xyz"), "quat": turned(joint)}
        element = ET.Element("body", name=link.get("name", ""), **place)
        if joint is None:
            ET.SubElement(element, "freejoint")
        else:
            span = f"{attribute(joint, 'limit', 'lower')} {attribute(joint, 'limit', 'upper')}"
            effort = attribute(joint, "limit", "effort")
            ET.SubElement(
                element, "joint", name=joint.get("name", ""), axis=attribute(joint, "axis", "xyz"), range=span,
                actuatorfrcrange=f"-{effort} {effort}",
            )  # fmt: skip
        inertia = [attribute(link, "inertial/inertia", key) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
        ET.SubElement(
            element, "inertial", pos=attribute(link, "inertial/origin", "xyz"),
            mass=attribute(link, "inertial/mass", "value"), fullinertia=" ".join(inertia),
        )  # fmt: skip
        for shape in link.findall("collision"):
            size, pos = attribute(shape, "geometry/sphere", "radius"), attribute(shape, "origin", "xyz")
            ET.SubElement(element, "geom", type="sphere", size=size, pos=pos)
        for child in children.get(link.get("name", ""), []):
            below = root.find(f"link[@name='{attribute(child, 'child', 'link')}']")
            assert below is not None
            element.append(body(below, child))
        return element

    mujoco = ET.Element("mujoco", model="generated")
    ET.SubElement(mujoco, "compiler", angle="radian")
    world = ET.SubElement(mujoco, "worldbody")
    ET.SubElement(world, "geom", type="plane", size="10 10 1")
    torso = root.find("link[@name='torso']")
    assert torso is not None
    world.append(body(torso, None))
    return ET.tostring(mujoco, encoding="unicode")


def as_sdf(urdf: str) -> str:
    root, _ = tree_of(urdf)
    sdf = ET.Element("sdf", version="1.9")
    model = ET.SubElement(sdf, "model", name="generated")
    for joint in root.findall("joint"):
        element = ET.SubElement(model, "joint", name=joint.get("name", ""), type="revolute")
        parent, child = attribute(joint, "parent", "link"), attribute(joint, "child", "link")
        ET.SubElement(element, "parent").text = parent
        ET.SubElement(element, "child").text = child
        axis = ET.SubElement(element, "axis")
        ET.SubElement(axis, "xyz").text = attribute(joint, "axis", "xyz")
        limit = ET.SubElement(axis, "limit")
        for key in ("lower", "upper", "effort", "velocity"):
            ET.SubElement(limit, key).text = attribute(joint, "limit", key)
        joint.set("pose", f"{attribute(joint, 'origin', 'xyz')} {attribute(joint, 'origin', 'rpy')}")
    for link in root.findall("link"):
        element = ET.SubElement(model, "link", name=link.get("name", ""))
        joint = root.find(f"joint/child[@link='{link.get('name')}']/..")
        if joint is not None:
            ET.SubElement(element, "pose", relative_to=attribute(joint, "parent", "link")).text = joint.get("pose")
        inertial = ET.SubElement(element, "inertial")
        ET.SubElement(inertial, "pose").text = f"{attribute(link, 'inertial/origin', 'xyz')} 0 0 0"
        ET.SubElement(inertial, "mass").text = attribute(link, "inertial/mass", "value")
        inertia = ET.SubElement(inertial, "inertia")
        for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"):
            ET.SubElement(inertia, key).text = attribute(link, "inertial/inertia", key)
        for number, shape in enumerate(link.findall("collision")):
            collision = ET.SubElement(element, "collision", name=f"c{number}")
            ET.SubElement(collision, "pose").text = f"{attribute(shape, 'origin', 'xyz')} 0 0 0"
            sphere = ET.SubElement(ET.SubElement(collision, "geometry"), "sphere")
            ET.SubElement(sphere, "radius").text = attribute(shape, "geometry/sphere", "radius")
    return ET.tostring(sdf, encoding="unicode")


def with_meshes(urdf: str, shape: bipeds.Shape, folder: Path) -> str:
    """The URDF in a package, with feet that are meshes in millimetres, drawn and colliding."""
    trimesh = pytest.importorskip("trimesh")
    (folder / "meshes").mkdir()
    (folder / "package.xml").write_text("<package><name>far_walker</name></package>")
    root, _ = tree_of(urdf)
    size = 1e3 * shape.size
    foot = trimesh.creation.box([size * 2.0 * shape.sole[0], size * 2.0 * shape.sole[1], size * 0.02])
    foot.apply_translation([size * shape.sole_x, 0.0, size * (0.01 - shape.ankle)])
    foot.export(folder / "meshes" / "foot.stl")
    for link in root.findall("link"):
        for old in link.findall("collision"):
            link.remove(old)
        for role in ("visual", "collision") if link.get("name", "").endswith("_foot") else ():
            geometry = ET.SubElement(ET.SubElement(link, role), "geometry")
            ET.SubElement(geometry, "mesh", filename="package://far_walker/meshes/foot.stl", scale="0.001 0.001 0.001")
    return ET.tostring(root, encoding="unicode")


FORMATS = {"robot.xml": as_mjcf, "robot.sdf": as_sdf, "with_meshes.urdf": None}
SHAPES = [bipeds.Shape(order=("hip_pitch", "hip_roll", "hip_yaw")), *map(bipeds.random_shape, (1, 5))]


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("shape", SHAPES, ids=["given", "1", "5"])
def test_a_model_is_read_alike_in_every_format(tmp_path: Path, name: str, shape: bipeds.Shape) -> None:
    urdf, convert = bipeds.urdf(shape), FORMATS[name]
    made = []
    for file in ("robot.urdf", name):
        text = urdf if file != name else convert(urdf) if convert else with_meshes(urdf, shape, tmp_path)
        (tmp_path / file).write_text(text)
        out = tmp_path / f"from_{file}"
        out.mkdir()
        imported = import_robot(tmp_path / file, out, Given(), lambda _: None)
        data = yaml.safe_load((out / ROBOT).read_text())
        made.append(({key: data[key] for key in data if key not in ("model",)}, imported.biped))
    (first, own), (second, other) = made
    assert second == first
    assert other.effort_limits.tolist() == pytest.approx(own.effort_limits.tolist())
    assert other.mass == pytest.approx(own.mass)
