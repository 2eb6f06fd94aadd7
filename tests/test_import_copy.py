"""The safe copy of a model: what Drake refuses is out of it, and what it shows and weighs is the same."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import bipeds
import numpy as np
import pytest
from pydrake.geometry import Role

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.importing.given import Given
from pdhocbf_drake.importing.importer import import_robot
from pdhocbf_drake.importing.inertia import lifted
from pdhocbf_drake.importing.model_copy import ModelCopy, copy_model
from pdhocbf_drake.importing.parsed import ParsedModel

trimesh = pytest.importorskip("trimesh")


def copied(folder: Path, text: str, name: str = "robot.urdf", **packages: Path) -> ModelCopy:
    (folder / "out").mkdir()
    (folder / name).write_text(text)
    return copy_model(folder / name, folder / "out", packages, None, lambda _: None)


def with_shells(urdf: str, file: str) -> str:
    """The biped with that mesh drawn and colliding on its torso."""
    mesh = f'<geometry><mesh filename="{file}"/></geometry>'
    shells = f"<visual>{mesh}</visual><collision>{mesh}</collision></link>"
    return urdf.replace("</link>", shells, 1)


def ellipsoid() -> Any:
    """A finely divided ellipsoid whose three axes differ, off the origin."""
    shape = trimesh.creation.icosphere(subdivisions=4)
    return shape.apply_scale([0.1, 0.2, 0.3]).apply_translation([0.01, 0.02, 0.03])


def name_up(path: Path, axis: str) -> None:
    """Writes into a COLLADA file which axis is up."""
    text = re.sub(r"<up_axis>.*?</up_axis>", "", path.read_text())
    path.write_text(text.replace("</asset>", f"<up_axis>{axis}</up_axis></asset>", 1))


def corners(model: ParsedModel, role: Role) -> np.ndarray:
    points = model.points([model.base], (role,))
    return np.array([points.min(axis=0), points.max(axis=0)])


@pytest.mark.parametrize("ending", ["stl", "obj", "ply", "dae", "glb"])
def test_meshes_keep_their_place_and_size(tmp_path: Path, ending: str) -> None:
    shape = ellipsoid()
    if ending == "glb":  # whose y is up
        shape.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    shape.export(tmp_path / f"shell.{ending}")
    if ending == "dae":
        name_up(tmp_path / "shell.dae", "Z_UP")
    model = ParsedModel(copied(tmp_path, with_shells(bipeds.urdf(bipeds.Shape()), f"shell.{ending}")).path)
    wanted = np.array([[-0.09, -0.18, -0.27], [0.11, 0.22, 0.33]])
    for role in (Role.kIllustration, Role.kProximity):
        np.testing.assert_allclose(corners(model, role), wanted, atol=2e-3)


def test_parts_whose_material_is_missing_are_kept(tmp_path: Path) -> None:
    ellipsoid().export(tmp_path / "shell.dae")
    name_up(tmp_path / "shell.dae", "Z_UP")
    text = (tmp_path / "shell.dae").read_text()
    (tmp_path / "shell.dae").write_text(re.sub(r'<instance_effect url="#', r"\g<0>not_", text))
    model = ParsedModel(copied(tmp_path, with_shells(bipeds.urdf(bipeds.Shape()), "shell.dae")).path)
    wanted = np.array([[-0.09, -0.18, -0.27], [0.11, 0.22, 0.33]])
    np.testing.assert_allclose(corners(model, Role.kIllustration), wanted, atol=2e-3)


def test_an_upright_axis_that_collada_names_counts(tmp_path: Path) -> None:
    ellipsoid().export(tmp_path / "shell.dae")
    name_up(tmp_path / "shell.dae", "Y_UP")
    model = ParsedModel(copied(tmp_path, with_shells(bipeds.urdf(bipeds.Shape()), "shell.dae")).path)
    wanted = np.array([[-0.09, -0.33, -0.18], [0.11, 0.27, 0.22]])
    np.testing.assert_allclose(corners(model, Role.kIllustration), wanted, atol=2e-3)


@pytest.mark.parametrize("stored_upright", [True, False])
def test_an_upright_axis_counts_unless_meshes_reach_to_the_joints_without_it(
    tmp_path: Path, stored_upright: bool
) -> None:
    """Many robots' files name y though z is up in them, and readers that pass over the name show them rightly."""
    thigh = trimesh.creation.box([0.1, 0.1, 0.3]).apply_translation([0.0, 0.0, -0.15])
    if not stored_upright:
        thigh.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    thigh.export(tmp_path / "thigh.dae")
    name_up(tmp_path / "thigh.dae", "Y_UP")
    visual = '<visual><geometry><mesh filename="thigh.dae"/></geometry></visual>'
    link = '<link name="left_hip_pitch_link">'
    (tmp_path / "robot.urdf").write_text(bipeds.urdf(bipeds.Shape()).replace(link, link + visual))
    (tmp_path / "out").mkdir()
    made = import_robot(tmp_path / "robot.urdf", tmp_path / "out", Given(), lambda _: None)
    assert any("up axis that mesh files name passed over" in change for change in made.changes) == stored_upright
    model = ParsedModel(tmp_path / "out" / "model.urdf")
    drawn = model.points([model.plant.GetBodyByName("left_hip_pitch_link")], (Role.kIllustration,))
    np.testing.assert_allclose(np.ptp(drawn, axis=0), [0.1, 0.1, 0.3], atol=1e-4)


def test_detailed_meshes_are_simplified(tmp_path: Path) -> None:
    for number in range(3):
        fine = trimesh.creation.icosphere(subdivisions=6)  # 81920 triangles
        fine.export(tmp_path / f"shell{number}.stl")
    urdf = bipeds.urdf(bipeds.Shape())
    for number in range(3):
        urdf = with_shells(urdf, f"shell{number}.stl")
    copy = copied(tmp_path, urdf)
    size = sum(path.stat().st_size for path in (tmp_path / "out" / "meshes").iterdir())
    assert size < 5e6
    assert any(re.fullmatch(r"visual meshes simplified from 245760 to \d{5} triangles", c) for c in copy.changes)
    extent = corners(ParsedModel(copy.path), Role.kIllustration)
    np.testing.assert_allclose(extent, [[-1.0] * 3, [1.0] * 3], atol=0.01)


@pytest.mark.parametrize(
    "url", ["package://my_robot/meshes/shell.stl", "meshes/shell.stl", "model://my_robot/meshes/shell.stl"]
)
def test_meshes_are_found(tmp_path: Path, url: str) -> None:
    home = tmp_path / "my_robot"
    (home / "meshes").mkdir(parents=True)
    ellipsoid().export(home / "meshes" / "shell.stl")
    copy = copied(home, with_shells(bipeds.urdf(bipeds.Shape()), url))
    assert "package://" not in copy.path.read_text()
    assert not [change for change in copy.changes if "left out" in change]


def test_a_package_can_be_named(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    ellipsoid().export(tmp_path / "elsewhere" / "shell.stl")
    text = with_shells(bipeds.urdf(bipeds.Shape()), "package://far/shell.stl")
    (tmp_path / "a").mkdir()
    copy = copied(tmp_path / "a", text)
    assert copy.changes == ["meshes that are not there left out: package://far/shell.stl"]
    (tmp_path / "b").mkdir()
    copy = copied(tmp_path / "b", text, far=tmp_path / "elsewhere")
    assert copy.changes == []


ODD = """<gazebo/><material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
<material name="grey"><color rgba="0.1 0.1 0.1 1"/></material>
<transmission name="t"><type>transmission_interface/FourBarLinkageTransmission</type><joint name="left_knee_pitch"/>
<actuator name="a"/></transmission>
<link name="odd"><inertial><mass value="1"/><inertia ixx="0.9" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><box size="0.1 0.1 0.1"/></geometry><material name="grey"/></visual>
<collision><geometry><drake:capsule radius="0.1" length="0.2"/></geometry></collision></link>
<joint name="odd_joint" type="revolute"><parent link="torso"/><child link="odd"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/><dynamics friction="0.3"/><mimic joint="left_knee_pitch"/></joint>
<link name="world"/><joint name="floating_base" type="floating"><parent link="world"/><child link="torso"/></joint>
</robot>"""


def test_what_drake_refuses_or_warns_of_is_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    copy = copied(tmp_path, bipeds.urdf(bipeds.Shape()).replace("</robot>", ODD))
    model = ParsedModel(copy.path)
    assert copy.changes == [
        "joint floating_base removed, so that torso floats",
        "joints no longer follow others (mimic): odd_joint",
        "inertias that no body can have raised: odd",
        "joint friction left out, which Drake does not have",
    ]
    assert copy.leaders == {"odd_joint": "left_knee_pitch"}
    assert model.mass == pytest.approx(30.0)
    assert len(model.plant.GetCollisionGeometriesForBody(model.plant.GetBodyByName("odd"))) == 1
    assert not caplog.records


def test_lifted_inertias_are_possible_and_near() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        moments = np.sort(rng.uniform(-0.2, 1.0, 3))
        inertia = axes @ np.diag(moments) @ axes.T
        better = lifted(2.0, inertia)
        possible = moments[0] > 0.0 and moments[2] <= moments[0] + moments[1]
        assert (better is None) == possible
        if better is not None:
            found = np.linalg.eigvalsh(better)
            assert found[0] > 0.0
            assert found[2] <= found[0] + found[1]
            assert found[2] >= moments[2] - 1e-12
            assert lifted(2.0, better) is None


def test_files_that_are_no_model(tmp_path: Path) -> None:
    for text, says in (
        ("<robot", "can't be read: "),
        ("<html/>", "is no URDF, SDF or MJCF: its first tag is <html>"),
        ('<robot xmlns:xacro="x"><xacro:arg name="a"/></robot>', "is a xacro file; make a URDF of it with `xacro"),
    ):
        (tmp_path / "robot.urdf").write_text(text)
        with pytest.raises(InputError) as caught:
            copy_model(tmp_path / "robot.urdf", tmp_path, {}, None, lambda _: None)
        assert says in str(caught.value)
