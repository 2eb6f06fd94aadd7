"""Diagram of the controller on the multibody robot on the ground."""

from __future__ import annotations

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import Meshcat, ProximityProperties, Role, RoleAssign, SceneGraph
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import MatrixGain

from pdhocbf_drake.fitting.preview import Step, is_mirrored, preview
from pdhocbf_drake.ground.bodies import add_ground
from pdhocbf_drake.robot import Biped, sole_pose, swing_lever, upright_posture
from pdhocbf_drake.robot.leg import leg_length
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.diagram import (
    add_controller,
    add_fused_controller,
    connect_controller,
    connect_fused_controller,
)
from pdhocbf_drake.simulation.disturbance import add_measurement, add_model_error, tilted_gravity, timed_forces
from pdhocbf_drake.simulation.drake_config import plant_config
from pdhocbf_drake.simulation.drives import connect_sampled_drives
from pdhocbf_drake.simulation.feeling import add_loads, connect_footing, footing_of
from pdhocbf_drake.simulation.granted import grip_of
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.start_axes import add_base, positions_to_world, state_to_world, velocities_to_world
from pdhocbf_drake.simulation.wiring import Form, LoggedDiagram, Wiring
from pdhocbf_drake.systems.fall_detector import FallDetector
from pdhocbf_drake.systems.foot_reference import FootReference
from pdhocbf_drake.systems.footing import Footing
from pdhocbf_drake.systems.fused_controller import BodyBlocks
from pdhocbf_drake.systems.ground_reference import GroundReference
from pdhocbf_drake.systems.inverse_kinematics import InverseKinematics
from pdhocbf_drake.systems.joint_targets import LATENCY, joint_targets
from pdhocbf_drake.systems.push_schedule import PushSchedule
from pdhocbf_drake.systems.state_estimator import StateEstimator
from pdhocbf_drake.systems.torque_bias import TorqueBias
from pdhocbf_drake.systems.turn_reference import TurnReference
from pdhocbf_drake.systems.turning_zmp_offset import TurningZmpOffset
from pdhocbf_drake.systems.unbundled import unbundled
from pdhocbf_drake.systems.zmp_offset import ZmpOffset


def biped_diagram(
    scenario: Scenario,
    walk: Walk,
    biped: Biped,
    meshcat: Meshcat | None = None,
    form: Form = "blocks",
    real: Biped | None = None,
) -> LoggedDiagram:
    """clock, barriers -> MPC -> feet -> inverse kinematics -> joint targets -> plant with PD -> estimator -> MPC.

    Args:
        biped: the controller's model.
        real: the robot as its file has it, where the controller's model is another one.
    """
    config = walk.gait.config
    wiring = Wiring(config.tick)
    posture = initial_posture(walk, biped)
    sampled = scenario.measurement.drives == "sampled"
    yaw = walk.gait.step(-1).yaw
    plant = add_robot(wiring.builder, scenario, biped, posture, not sampled, yaw)
    if meshcat is not None:
        # This loads matplotlib, which a run that is not shown does not need.
        from pydrake.visualization import AddDefaultVisualization

        AddDefaultVisualization(wiring.builder, meshcat)
    _offer_in_world(wiring, plant, biped, yaw)
    add_model_error(wiring, scenario.model_error, plant, real or biped)

    footing = footing_of(scenario, walk, biped)
    uneven = walk.gait.uneven or footing is not None
    estimator = wiring.add("state_estimator", unbundled(StateEstimator(biped, config.tick, uneven)))
    wiring.connect(estimator, "robot_state", "contact_forces")
    add_joint_sensors(wiring, plant, biped)
    sensed = scenario.measurement.source == "sensors"
    if sensed:
        # This loads Drake's sensors and the estimator's machine code, which other walks do not need.
        from pdhocbf_drake.simulation.estimator import add_estimator, connect_estimator
        from pdhocbf_drake.simulation.sensors import add_sensors

        seed = scenario.seed if scenario.measurement.seed is None else scenario.measurement.seed
        add_sensors(wiring, scenario.measurement, seed, plant, biped, posture[biped.q_index])
        add_estimator(wiring, scenario.measurement, biped, walk.gait.step(-1))
    if footing is not None:
        add_loads(wiring, plant, biped, sensed)
    soles = np.zeros((2, 6))
    soles[:, :2], soles[:, 5] = walk.gait.feet_at_start, walk.gait.step(-1).yaw
    soles[:, 2] = walk.gait.step(-1).height
    starts = {"lip_state": walk.at_rest.ravel(), "foot_state": soles.ravel()}
    starts |= {} if footing is None else {"foot_load": np.full(2, 0.5 * biped.weight)}
    add_measurement(wiring, scenario.measurement, scenario.seed, **starts)

    add_walking = _add_fused if form == "fused" else _add_blocks
    body = _body_blocks(scenario, walk, biped, posture, footing)
    add_walking(wiring, walk, body, LATENCY * plant.time_step())
    targets = wiring.add("joint_targets", joint_targets(biped, posture[biped.q_index], plant.time_step()))
    terrain = None if scenario.terrain.flat else scenario.terrain
    detector = wiring.add("fall_detector", FallDetector(config.com_height, config.tick, terrain))

    if walk.gait.turns:
        wiring.log("turn_reference")
    if scenario.whole_body.kind != "closed_form":
        wiring.log("whole_body")
    if walk.gait.uneven:
        wiring.log("ground_reference")
    if footing is not None:
        wiring.log("foot_target", "ground_target", "landing_delay")
    if uneven:
        ground = wiring.port("ground_reference" if footing is None else "ground_target")
        wiring.builder.Connect(ground, estimator.GetInputPort("ground_reference"))
    if sensed:
        connect_estimator(wiring)
    wiring.connect(detector, "com_z", *["lip_state"] * (terrain is not None))
    wiring.connect(targets, "desired_state")
    learns = body.bias is not None
    wiring.builder.Connect(wiring.port("sent_torque" if learns else "feedforward"), targets.GetInputPort("feedforward"))
    wiring.log(*["torque_bias"] * learns)
    if sampled:
        connect_sampled_drives(wiring, plant, biped, targets, posture, scenario.measurement.encoders.cutoff)
    else:
        connect_joints(wiring.builder, plant, biped, targets)
    if scenario.pushes or any(scenario.wind):
        push = wiring.add("push_schedule", PushSchedule(timed_forces(scenario, (plant, biped)), config.tick))
        applied = plant.get_applied_spatial_force_input_port()
        wiring.builder.Connect(push.GetOutputPort("applied_spatial_force"), applied)
        wiring.log("push")
    wiring.log("com_z", "foot_state", "ground_load", "joint_state", "foot_reference", "desired_state", "feedforward")
    wiring.log("whole_body_zmp", "actuation", "robot_state", "contact_forces")
    return wiring.build("biped_walk")


def _body_blocks(
    scenario: Scenario, walk: Walk, biped: Biped, posture: np.ndarray, footing: Footing | None
) -> BodyBlocks:
    """Planned soles, inverse kinematics, and the ZMP offset that the legs cause."""
    gait, grip, layer = walk.gait, grip_of(biped, scenario), scenario.whole_body
    uneven = gait.uneven or footing is not None
    lever = swing_lever(biped, standing_posture(walk, biped))
    # Where left and right differ, as in a turn or on a robot that is no mirror image of itself, each foot has a table.
    mirrored = is_mirrored(preview(biped, Step.of(gait.config)), leg_length(biped))
    zmp_offset = ZmpOffset if mirrored and not gait.turns else TurningZmpOffset
    return BodyBlocks(
        FootReference(gait),
        InverseKinematics(biped, posture, gait.config.tick, gait.turns, grip, uneven, layer, gait.period),
        zmp_offset(gait, walk.mpc.config.horizon, lever),
        TurnReference(gait) if gait.turns else None,
        GroundReference(gait) if gait.uneven else None,
        footing,
        TorqueBias(gait, biped.weight, biped.effort_limits) if scenario.biped.learns_torque else None,
    )


def _add_blocks(wiring: Wiring, walk: Walk, body: BodyBlocks, latency: float) -> None:
    """Adds and connects the controller, block by block."""
    controller = add_controller(wiring, walk, latency)
    foot_reference = wiring.add("foot_reference", body.feet)
    kinematics = wiring.add("inverse_kinematics", unbundled(body.kinematics))
    offset = wiring.add("zmp_offset", body.offset)
    connect_controller(wiring, walk, controller)
    wiring.connect(controller, "zmp_offset")
    wiring.connect(controller, "foot_state", measured=True)
    wiring.connect(foot_reference, "gait_phase", "foot_plan", "resumed")
    wiring.connect(kinematics, *["actuation"] * (body.kinematics.layer is not None))
    wiring.connect(kinematics, "gait_phase", "com_height", "com_reference", "zmp_reference")
    changes = "last_step", "resumed", *["course"] * walk.gait.turns
    wiring.connect(offset, "gait_phase", "whole_body_zmp", "zmp_reference", *changes)
    wiring.connect(offset, "foot_reference", "foot_plan", "stance_plan")
    if body.bias is not None:
        bias = wiring.add("torque_bias", unbundled(body.bias))
        wiring.connect(bias, "gait_phase", "solver_status", "feedforward", "actuation")
    if body.turn is not None:
        turn_reference = wiring.add("turn_reference", body.turn)
        wiring.connect(turn_reference, "gait_phase", *changes)
        wiring.connect(kinematics, "turn_reference")
    if body.ground is not None:
        ground_reference = wiring.add("ground_reference", body.ground)
        wiring.connect(ground_reference, "gait_phase", "com_reference", "zmp_reference", *changes)
    if body.footing is not None:
        connect_footing(wiring, wiring.add("footing", unbundled(body.footing)), kinematics)
        wiring.connect(controller, "landing_delay")
        return
    wiring.connect(kinematics, "foot_reference", *["ground_reference"] * (body.ground is not None))


def _add_fused(wiring: Wiring, walk: Walk, body: BodyBlocks, latency: float) -> None:
    """The same in one block."""
    controller = add_fused_controller(wiring, walk, latency, body)
    connect_fused_controller(wiring, walk, controller)
    wiring.connect(controller, *["actuation"] * (body.kinematics.layer is not None or body.bias is not None))
    measured = "foot_state", *["foot_load"] * (body.footing is not None)
    wiring.connect(controller, *measured, measured=True)


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


def _offer_in_world(wiring: Wiring, plant: MultibodyPlant, biped: Biped, yaw: float) -> None:
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
