"""Contact of the feet: four spheres at the corners of the declared sole, which must fit the foot's geometry."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bipeds
import numpy as np
import pytest
import yaml
from pydrake.geometry import Role, SceneGraph, Sphere
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import DiagramBuilder

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.robot import SIDES, Biped, models_folder
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate


def added(robot: Biped) -> tuple[MultibodyPlant, SceneGraph]:
    plant, scene_graph = AddMultibodyPlant(MultibodyPlantConfig(), DiagramBuilder())
    robot.add_to(plant)
    return plant, scene_graph


def with_boxes(folder: Path, **changes: Any) -> Path:
    """A biped whose feet are boxes, which Drake would let rock on the ground."""
    path = bipeds.write(folder, bipeds.Shape(), **changes)
    urdf = folder / "robot.urdf"
    root = bipeds.ET.fromstring(urdf.read_text())
    for side in SIDES:
        foot = root.find(f"link[@name='{side}_foot']")
        assert foot is not None
        for collision in foot.findall("collision"):
            foot.remove(collision)
        collision = bipeds.ET.SubElement(foot, "collision", name="box")
        bipeds.ET.SubElement(collision, "origin", xyz="0.02 0 -0.035")
        bipeds.ET.SubElement(bipeds.ET.SubElement(collision, "geometry"), "box", size="0.2 0.12 0.04")
    urdf.write_text(bipeds.ET.tostring(root, encoding="unicode"))
    return path


def contact_of(plant: MultibodyPlant, scene_graph: SceneGraph, body: str) -> list[Any]:
    inspector = scene_graph.model_inspector()
    frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName(body).index())
    return list(inspector.GetGeometries(frame, Role.kProximity))


def test_spheres_at_the_soles_corners_take_the_place_of_the_feets_geometry(tmp_path: Path) -> None:
    plant, scene_graph = added(Biped.load(str(with_boxes(tmp_path))))
    inspector = scene_graph.model_inspector()
    for side in SIDES:
        geometries = contact_of(plant, scene_graph, f"{side}_foot")
        shapes = [inspector.GetShape(geometry) for geometry in geometries]
        assert [type(shape) for shape in shapes] == [Sphere] * 4
        centres = [inspector.GetPoseInFrame(geometry).translation() for geometry in geometries]
        lowest = [centre - [0.0, 0.0, shape.radius()] for centre, shape in zip(centres, shapes, strict=True)]
        corners = {(round(x, 9), round(y, 9), round(z, 9)) for x, y, z in lowest}
        assert corners == {(x, y, -0.055) for x in (-0.08, 0.12) for y in (-0.06, 0.06)}


def test_the_models_own_geometry_is_kept_where_the_robot_file_says_so(tmp_path: Path) -> None:
    plant, scene_graph = added(Biped.load(str(with_boxes(tmp_path, keep_contact=True))))
    assert [len(contact_of(plant, scene_graph, f"{side}_foot")) for side in SIDES] == [1, 1]


def test_spheres_ignore_what_the_foot_ignored(tmp_path: Path) -> None:
    path = models_folder() / "biped"
    robot = yaml.safe_load((path / "biped.yaml").read_text())
    robot |= {"model": str(path / robot["model"]), "packages": {"pdhocbf_models": str(path.parent)}}
    filtered = []
    for keep in (True, False):
        (tmp_path / "robot.yaml").write_text(yaml.safe_dump(robot | {"keep_contact": keep}))
        plant, scene_graph = added(Biped.load(str(tmp_path / "robot.yaml")))
        inspector = scene_graph.model_inspector()
        bodies = ["torso", *(f"{side}_{link}" for side in SIDES for link in ("thigh", "shank", "foot"))]
        shapes = {body: contact_of(plant, scene_graph, body)[0] for body in bodies}
        filtered.append([inspector.CollisionFiltered(a, b) for a in shapes.values() for b in shapes.values() if a != b])
    assert filtered[0] == filtered[1]
    assert set(filtered[0]) == {True, False}


def test_a_walk_on_such_spheres_is_that_on_the_models_own(tmp_path: Path) -> None:
    path = models_folder() / "biped"
    robot = yaml.safe_load((path / "biped.yaml").read_text())
    robot |= {"model": str(path / robot["model"]), "packages": {"pdhocbf_models": str(path.parent)}}
    (tmp_path / "robot.yaml").write_text(yaml.safe_dump(robot | {"keep_contact": False}))
    own = simulate(load_scenario("walking", "duration: 1.6"))
    other = simulate(load_scenario("walking", f"{{duration: 1.6, robot: {tmp_path / 'robot.yaml'}}}"))
    np.testing.assert_allclose(other["robot_state"], own["robot_state"], atol=1e-9)


SOLE = {"link": "left_foot", "xyz": [0.02, 0.0, -0.055], "half_size": [0.1, 0.06]}


@pytest.mark.parametrize(
    ("entries", "says"),
    [
        ({"xyz": [0.04, 0.0, -0.055]}, "its rectangle reaches 20 mm beyond the foot; one of half_size [0.100, 0.060] "
         "fits, with its centre 20 mm behind and 0 mm to the right"),
        ({"xyz": [0.02, -0.02, -0.055]}, "its rectangle reaches 20 mm beyond the foot; one of half_size "
         "[0.100, 0.060] fits, with its centre 0 mm behind and 20 mm to the left"),
        ({"half_size": [0.13, 0.06]}, "its rectangle reaches 30 mm beyond the foot"),
        ({"half_size": [0.1, 0.1]}, "its rectangle reaches 40 mm beyond the foot"),
        ({"xyz": [0.02, 0.0, -0.035]}, "its plane is 20 mm above the foot's lowest point"),
        ({"xyz": [0.02, 0.0, -0.075]}, "its plane is 20 mm below the foot's lowest point"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("boxes", [False, True])
def test_a_sole_that_does_not_fit_its_foot(tmp_path: Path, boxes: bool, entries: dict[str, Any], says: str) -> None:
    make: Any = with_boxes if boxes else lambda folder, **changes: bipeds.write(folder, bipeds.Shape(), **changes)
    left = bipeds.robot(bipeds.Shape())["left"]
    robot = Biped.load(str(make(tmp_path, left=left | {"sole": SOLE | entries})))
    with pytest.raises(ModelError) as caught:
        added(robot)
    whole = "robot 'generated': left.sole does not fit the contact geometry of the foot: "
    assert str(caught.value).startswith(whole + says)


def test_a_sole_within_its_foot_fits(tmp_path: Path) -> None:
    left = bipeds.robot(bipeds.Shape())["left"]
    for half_size in ([0.1, 0.06], [0.05, 0.03], [0.103, 0.062]):
        path = with_boxes(tmp_path, left=left | {"sole": SOLE | {"half_size": half_size}})
        plant, _ = added(Biped.load(str(path)))
        assert Parser(plant).scene_graph() is not None
