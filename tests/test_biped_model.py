"""The biped's model: strict parsing, masses, symmetry, frames, orders of foreign models, standing still."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from biped_cases import biped, ik, mirrored_joints, standing
from pydrake.geometry import HalfSpace
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import PdControllerGains
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from pdhocbf_drake.robot import SIDES, Biped, load_robot_config, models_folder, robot_names, upright_posture

URDF = models_folder() / "biped" / "biped.urdf"


def test_it_is_listed_and_found() -> None:
    assert "biped" in robot_names()
    assert Path(load_robot_config("biped").model).samefile(URDF)


@pytest.mark.parametrize("url", [False, True])
def test_strict_parsing(url: bool) -> None:
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(), builder)
    parser = Parser(plant)
    parser.SetStrictParsing()
    if url:
        parser.package_map().AddPackageXml(str(models_folder() / "package.xml"))
        parser.AddModels(url="package://pdhocbf_models/biped/biped.urdf")
    else:
        parser.AddModels(URDF)
    plant.Finalize()
    assert plant.num_actuators() == 12
    spheres = [len(plant.GetCollisionGeometriesForBody(plant.GetBodyByName(f"{side}_foot"))) for side in SIDES]
    assert spheres == [4, 4]


def test_the_committed_model_is_what_its_script_writes() -> None:
    spec = importlib.util.spec_from_file_location("build_urdf", URDF.with_name("build_urdf.py"))
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert ET.canonicalize(ET.tostring(script.build().getroot())) == ET.canonicalize(URDF.read_text())


def test_every_shell_is_there_and_small() -> None:
    meshes = {URDF.parent / mesh.attrib["filename"] for mesh in ET.parse(URDF).getroot().iter("mesh")}
    assert len(meshes) == 13
    assert sum(mesh.stat().st_size for mesh in meshes) < 2e6


def test_mass_and_com_height() -> None:
    assert biped().mass == pytest.approx(29.0, abs=1e-9)
    q = ik().solve(standing(), biped().bent_knee).q
    context = biped().plant.CreateDefaultContext()
    biped().plant.SetPositions(context, q)
    assert biped().plant.CalcCenterOfMassPositionInWorld(context)[2] == pytest.approx(0.58, abs=1e-7)
    for side, y in (("left", 0.08), ("right", -0.08)):
        pose = biped().soles[side].frame.CalcPoseInWorld(context)
        np.testing.assert_allclose(pose.translation(), [0.02, y, 0.0], atol=1e-7)
        np.testing.assert_allclose(pose.rotation().matrix(), np.eye(3), atol=1e-7)


def test_left_and_right_are_mirror_images() -> None:
    plant, context = biped().plant, biped().plant.CreateDefaultContext()
    joints = np.array([0.1, 0.2, -0.5, 0.9, -0.4, 0.1, -0.2, 0.1, -0.3, 0.7, -0.2, 0.05])
    mass_matrices = []
    for angles in (joints, mirrored_joints(joints)):
        q = np.array(biped().bent_knee)
        q[biped().q_index] = angles
        plant.SetPositions(context, q)
        mass_matrices.append(plant.CalcMassMatrix(context)[np.ix_(biped().v_index, biped().v_index)])
    image = np.array([mirrored_joints(row) for row in np.array([mirrored_joints(r) for r in mass_matrices[1]]).T])
    np.testing.assert_allclose(image, mass_matrices[0], atol=1e-12)
    np.testing.assert_array_equal(biped().effort_limits[:6], biped().effort_limits[6:])
    np.testing.assert_array_equal(biped().position_limits[[2, 3, 4]], biped().position_limits[[8, 9, 10]])
    np.testing.assert_array_equal(biped().position_limits[[0, 1, 5]], -biped().position_limits[[6, 7, 11], ::-1])


def test_joint_order_is_by_role_and_reflected_inertia_is_in_the_model() -> None:
    assert biped().joint_names[:3] == ("left_hip_yaw", "left_hip_roll", "left_hip_pitch")
    plant, context = biped().plant, biped().plant.CreateDefaultContext()
    for name, u in zip(biped().joint_names, biped().u_index, strict=True):
        actuator = plant.GetJointActuatorByName(name)
        assert actuator.input_start() == u
        assert actuator.calc_reflected_inertia(context) == pytest.approx(0.01)


def right_leg_first(tmp_path: Path) -> Biped:
    """The same robot written in another order: right leg first, each chain listed from the foot up."""
    robot = ET.parse(URDF).getroot()
    robot[:] = reversed(list(robot))
    path = tmp_path / "other.urdf"
    ET.ElementTree(robot).write(path)
    return Biped(load_robot_config("biped").model_copy(update={"model": str(path)}))


def test_the_models_own_order_does_not_matter(tmp_path: Path) -> None:
    other = right_leg_first(tmp_path)
    assert not np.array_equal(other.u_index, biped().u_index)
    posture = standing()
    q = upright_posture(other, posture.com, posture.left, posture.right)
    expected = upright_posture(biped(), posture.com, posture.left, posture.right)
    np.testing.assert_allclose(q[other.q_index], expected[biped().q_index], atol=1e-7)
    np.testing.assert_array_equal(other.effort_limits, biped().effort_limits)


def test_a_simulated_plant_orders_state_and_actuation_as_the_control_copy() -> None:
    plant = MultibodyPlant(1e-3)
    biped().add_to(plant)
    plant.Finalize()
    joints = [plant.GetJointByName(name) for name in biped().joint_names]
    assert [joint.position_start() for joint in joints] == biped().q_index.tolist()
    actuators = {a.joint().name(): a for a in map(plant.get_joint_actuator, plant.GetJointActuatorIndices())}
    assert [actuators[name].input_start() for name in biped().joint_names] == biped().u_index.tolist()


def test_it_stands_still_under_its_gains() -> None:
    posture = standing()
    q = upright_posture(biped(), posture.com, posture.left, posture.right)
    builder = DiagramBuilder()
    config = MultibodyPlantConfig(time_step=1e-3, discrete_contact_approximation="sap")
    plant, _ = AddMultibodyPlant(config, builder)
    instance = biped().add_to(plant)
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform(), HalfSpace(), "ground", CoulombFriction(0.8, 0.8)
    )
    for name, kp, kd in zip(biped().joint_names, biped().kp, biped().kd, strict=True):
        plant.GetJointActuatorByName(name).set_controller_gains(PdControllerGains(p=kp, d=kd))
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositions(context, q)
    wanted = np.concatenate([q[biped().q_index], np.zeros(12)])
    plant.get_desired_state_input_port(instance).FixValue(context, wanted)
    plant.get_actuation_input_port(instance).FixValue(context, np.zeros(12))

    def soles() -> np.ndarray:
        frames = (plant.GetFrameByName(f"{side}_sole_centre") for side in SIDES)
        return np.array([frame.CalcPoseInWorld(context).translation() for frame in frames])

    simulator.AdvanceTo(3.0)
    before, com = soles(), plant.CalcCenterOfMassPositionInWorld(context)
    simulator.AdvanceTo(4.5)
    assert abs(soles() - before).max() < 2e-6  # no creep: µm, not mm
    assert (
        abs(plant.CalcCenterOfMassPositionInWorld(context) - com).max() < 1e-4
    )  # the last of the sag that the PD alone allows
    assert abs(plant.CalcCenterOfMassPositionInWorld(context) - posture.com).max() < 0.01
    assert abs(plant.GetVelocities(context)).max() < 1e-4
    assert plant.get_contact_results_output_port().Eval(context).num_point_pair_contacts() == 8
