"""The multibody robot on its ground in a diagram: plant, posture, ports of state and joints, drives."""

from __future__ import annotations

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import ProximityProperties, Role, RoleAssign, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import MatrixGain

from pdhocbf_drake.ground.bodies import add_ground
from pdhocbf_drake.robot import Biped, sole_pose, upright_posture
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.disturbance import tilted_gravity
from pdhocbf_drake.simulation.drake_config import plant_config
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.start_axes import add_base, positions_to_world, state_to_world, velocities_to_world
from pdhocbf_drake.simulation.wiring import Wiring


def initial_posture(walk: Walk, biped: Biped) -> np.ndarray:
    """q (19,) at tick 0: `standing_posture`, moved to where the walk starts."""
    q, start = standing_posture(walk, biped), walk.gait.step(-1)
    if start.x or start.y or start.yaw or start.height:
        there = RigidTransform(RollPitchYaw(0.0, 0.0, start.yaw), [start.x, start.y, start.height])
        quaternion, place = biped.base_q_index[:4], biped.base_q_index[4:]
        base = there @ RigidTransform(Quaternion(q[quaternion] / np.linalg.norm(q[quaternion])), q[place])
        q[quaternion], q[place] = base.rotation().ToQuaternion().wxyz(), base.translation()
    return q


def standing_posture(walk: Walk, biped: Biped) -> np.ndarray:
    """q (19,): the CoM at its commanded height over the origin, between the feet, which face ahead along x."""
    half = walk.gait.footsteps.width / 2.0
    left, right = sole_pose(0.0, half), sole_pose(0.0, -half)
    return upright_posture(biped, np.array([0.0, 0.0, walk.gait.height(0)[0]]), left, right)


def add_robot(
    builder: DiagramBuilder, scenario: Scenario, biped: Biped, posture: np.ndarray, pd: bool = True, yaw: float = 0.0
) -> MultibodyPlant:
    """The robot on the scenario's ground, standing in `posture` (19,) by default, with or without the plant's PD.

    With a `yaw` the plant's coordinates are along axes at that heading, see `start_axes` [rad].
    """
    plant, scene_graph = AddMultibodyPlant(plant_config(scenario.plant), builder)
    plant.set_name("plant")
    scene_graph.set_name("scene_graph")
    biped.add_to(plant)
    if yaw:
        add_base(plant, biped, yaw)
    _set_friction(plant, scene_graph, CoulombFriction(scenario.friction, scenario.friction))
    add_ground(plant, scenario.terrain, scenario.friction)
    if pd:
        _set_gains(plant, biped)
    if any(scenario.model_error.gravity_tilt_deg):
        gravity = plant.mutable_gravity_field()
        gravity.set_gravity_vector(tilted_gravity(scenario.model_error, gravity.gravity_vector()))
    plant.Finalize()
    plant.SetDefaultPositions(positions_to_world(biped, yaw).T @ posture if yaw else posture)
    return plant


def remove_what_is_only_seen(builder: DiagramBuilder, plant: MultibodyPlant) -> None:
    """Removes the shapes that touch nothing, whose poses would be computed with those of all others at every step."""
    scene_graph = builder.GetSubsystemByName("scene_graph")
    assert isinstance(scene_graph, SceneGraph)
    inspector = scene_graph.model_inspector()
    for geometry in set(inspector.GetAllGeometryIds()) - set(inspector.GetAllGeometryIds(Role.kProximity)):
        scene_graph.RemoveGeometry(plant.get_source_id(), geometry)


def _set_friction(plant: MultibodyPlant, scene_graph: SceneGraph, friction: CoulombFriction) -> None:
    """Gives every geometry the same friction, since Drake takes the harmonic mean of the two in contact."""
    inspector = scene_graph.model_inspector()
    for geometry in inspector.GetAllGeometryIds(Role.kProximity):
        properties = ProximityProperties(inspector.GetProximityProperties(geometry))
        properties.UpdateProperty("material", "coulomb_friction", friction)
        scene_graph.AssignRole(plant.get_source_id(), geometry, properties, RoleAssign.kReplace)


def _set_gains(plant: MultibodyPlant, biped: Biped) -> None:
    """Joint PD inside the plant's step, τ = sat(kp (q* − q) + kd (q̇* − q̇) + feedforward), with q and q̇ at its end.

    It is implicit, and so stable at any gain and step.
    """
    joints = zip(biped.joint_names, biped.kp, biped.kd, strict=True)
    gains = {name: PdControllerGains(p=p, d=d) for name, p, d in joints}
    # A plant that is not finalized lists no actuators by model instance.
    for actuator in map(plant.get_joint_actuator, plant.GetJointActuatorIndices()):
        actuator.set_controller_gains(gains[actuator.joint().name()])


def offer_in_world(wiring: Wiring, plant: MultibodyPlant, biped: Biped, yaw: float) -> None:
    """Offers the plant's state and contact forces along the world's axes."""
    forces = plant.get_generalized_contact_forces_output_port(model_instance(plant, biped))
    for name, port, matrix in (
        ("robot_state", plant.get_state_output_port(), state_to_world),
        ("contact_forces", forces, velocities_to_world),
    ):
        if yaw:
            turn = wiring.builder.AddNamedSystem(f"{name}_in_world", MatrixGain(matrix(biped, yaw)))
            wiring.builder.Connect(port, turn.get_input_port())
            port = turn.get_output_port()
        wiring.offer(name, port)


def add_joint_sensors(wiring: Wiring, plant: MultibodyPlant, biped: Biped) -> None:
    """Offers the joints' positions, velocities and torques in the order of `signals.JOINTS`."""
    count = len(biped.u_index)
    select = np.zeros((2 * count, plant.num_multibody_states()))
    select[np.arange(count), biped.q_index] = 1.0
    select[count + np.arange(count), plant.num_positions() + biped.v_index] = 1.0
    encoders = wiring.add("joint_encoders", MatrixGain(select))
    wiring.builder.Connect(plant.get_state_output_port(), encoders.get_input_port())
    wiring.offer("joint_state", encoders.get_output_port())
    sensors = wiring.add("torque_sensors", MatrixGain(np.eye(count)[biped.u_index]))
    applied = plant.get_net_actuation_output_port(model_instance(plant, biped))
    wiring.builder.Connect(applied, sensors.get_input_port())
    wiring.offer("actuation", sensors.get_output_port())


def connect_joints(builder: DiagramBuilder, plant: MultibodyPlant, biped: Biped, targets: Diagram) -> None:
    """Connects `joint_targets` to the plant's PD."""
    robot = model_instance(plant, biped)
    builder.Connect(targets.GetOutputPort("plant_desired_state"), plant.get_desired_state_input_port(robot))
    builder.Connect(targets.GetOutputPort("plant_actuation"), plant.get_actuation_input_port())


def model_instance(plant: MultibodyPlant, biped: Biped) -> ModelInstanceIndex:
    """The robot among the plant's models."""
    return plant.GetBodyByName(biped.config.base_link).model_instance()
