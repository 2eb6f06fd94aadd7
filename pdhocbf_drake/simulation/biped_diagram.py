"""Diagram of the controller on the multibody robot on the ground."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, System

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.biped_control import add_walking, body_blocks
from pdhocbf_drake.simulation.biped_plant import (
    add_joint_sensors,
    add_robot,
    connect_joints,
    initial_posture,
    offer_in_world,
    remove_what_is_only_seen,
)
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.disturbance import add_measurement, add_model_error, timed_forces
from pdhocbf_drake.simulation.drives import connect_sampled_drives
from pdhocbf_drake.simulation.feeling import add_loads, footing_of
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.wiring import Form, LoggedDiagram, Wiring
from pdhocbf_drake.systems.fall_detector import FallDetector
from pdhocbf_drake.systems.footing import Footing
from pdhocbf_drake.systems.joint_targets import LATENCY, joint_targets
from pdhocbf_drake.systems.push_schedule import PushSchedule
from pdhocbf_drake.systems.state_estimator import StateEstimator, last_zmp
from pdhocbf_drake.systems.unbundled import unbundled


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
    wiring, posture = Wiring(walk.gait.config.tick), initial_posture(walk, biped)
    plant = _add_plant(wiring, scenario, walk, biped, posture, meshcat, form)
    add_model_error(wiring, scenario.model_error, plant, real or biped)
    footing = footing_of(scenario, walk, biped)
    estimator = _add_measured_state(wiring, scenario, walk, biped, plant, posture, footing)
    body = body_blocks(scenario, walk, biped, posture, footing)
    add_walking(wiring, walk, body, LATENCY * plant.time_step(), form)
    targets = wiring.add("joint_targets", joint_targets(biped, posture[biped.q_index], plant.time_step()))
    _add_fall_detector(wiring, scenario, walk)
    _log_references(wiring, scenario, walk, footing)
    if walk.gait.uneven or footing is not None:
        ground = wiring.port("ground_reference" if footing is None else "ground_target")
        wiring.builder.Connect(ground, estimator.GetInputPort("ground_reference"))
    if scenario.measurement.source == "sensors":
        from pdhocbf_drake.simulation.estimator import connect_estimator  # as in `_add_measured_state`

        connect_estimator(wiring)
    _connect_targets(wiring, scenario, biped, plant, targets, posture, learns=body.bias is not None)
    _add_pushes(wiring, scenario, biped, plant)
    wiring.log("com_z", "foot_state", "ground_load", "joint_state", "foot_reference", "desired_state", "feedforward")
    wiring.log("whole_body_zmp", "actuation", "robot_state", "contact_forces")
    return wiring.build("biped_walk")


def _add_plant(
    wiring: Wiring, scenario: Scenario, walk: Walk, biped: Biped, posture: np.ndarray, meshcat: Meshcat | None,
    form: Form,
) -> MultibodyPlant:  # fmt: skip
    """The robot on its ground, shown where there is a Meshcat; one block's robot has no shapes that are only seen."""
    yaw, pd = walk.gait.step(-1).yaw, scenario.measurement.drives != "sampled"
    plant = add_robot(wiring.builder, scenario, biped, posture, pd, yaw)
    if meshcat is not None:
        # This loads matplotlib, which a run that is not shown does not need.
        from pydrake.visualization import AddDefaultVisualization

        AddDefaultVisualization(wiring.builder, meshcat)
    elif form == "fused":
        remove_what_is_only_seen(wiring.builder, plant)
    offer_in_world(wiring, plant, biped, yaw)
    return plant


def _add_measured_state(
    wiring: Wiring,
    scenario: Scenario,
    walk: Walk,
    biped: Biped,
    plant: MultibodyPlant,
    posture: np.ndarray,
    footing: Footing | None,
) -> System:
    """The true state, and what of it the controller gets; returns the block of the former."""
    uneven, start = walk.gait.uneven or footing is not None, walk.gait.step(-1)
    estimator = wiring.add("state_estimator", unbundled(StateEstimator(biped, uneven)))
    wiring.connect(estimator, "robot_state", "contact_forces")
    memory = wiring.builder.AddNamedSystem("last_zmp", last_zmp(wiring.tick))
    wiring.builder.Connect(wiring.port("lip_state"), memory.get_input_port())
    wiring.builder.Connect(memory.get_output_port(), estimator.GetInputPort("last_zmp"))
    add_joint_sensors(wiring, plant, biped)
    sensed = scenario.measurement.source == "sensors"
    if sensed:
        # This loads Drake's sensors and the estimator's machine code, which other walks do not need.
        from pdhocbf_drake.simulation.estimator import add_estimator
        from pdhocbf_drake.simulation.sensors import add_sensors

        seed = scenario.seed if scenario.measurement.seed is None else scenario.measurement.seed
        add_sensors(wiring, scenario.measurement, seed, plant, biped, posture[biped.q_index])
        add_estimator(wiring, scenario.measurement, biped, start)
    if footing is not None:
        add_loads(wiring, plant, biped, sensed)
    soles = np.zeros((2, 6))
    soles[:, :2], soles[:, 2], soles[:, 5] = walk.gait.feet_at_start, start.height, start.yaw
    starts = {"lip_state": walk.at_rest.ravel(), "foot_state": soles.ravel()}
    starts |= {} if footing is None else {"foot_load": np.full(2, 0.5 * biped.weight)}
    add_measurement(wiring, scenario.measurement, scenario.seed, **starts)
    return estimator


def _add_fall_detector(wiring: Wiring, scenario: Scenario, walk: Walk) -> None:
    terrain = None if scenario.terrain.flat else scenario.terrain
    detector = wiring.add("fall_detector", FallDetector(walk.gait.config.com_height, wiring.tick, terrain))
    wiring.connect(detector, "com_z", *["lip_state"] * (terrain is not None))


def _log_references(wiring: Wiring, scenario: Scenario, walk: Walk, footing: Footing | None) -> None:
    """Logs what only some walks have."""
    if walk.gait.turns:
        wiring.log("turn_reference")
    if scenario.whole_body.kind != "closed_form":
        wiring.log("whole_body")
    if walk.gait.uneven:
        wiring.log("ground_reference")
    if footing is not None:
        wiring.log("foot_target", "ground_target", "landing_delay")


def _connect_targets(
    wiring: Wiring,
    scenario: Scenario,
    biped: Biped,
    plant: MultibodyPlant,
    targets: Diagram,
    posture: np.ndarray,
    learns: bool,
) -> None:
    """From inverse kinematics through joint targets to the plant's PD, or to drives that sample."""
    wiring.connect(targets, "desired_state")
    wiring.builder.Connect(wiring.port("sent_torque" if learns else "feedforward"), targets.GetInputPort("feedforward"))
    wiring.log(*["torque_bias"] * learns)
    if scenario.measurement.drives == "sampled":
        connect_sampled_drives(wiring, plant, biped, targets, posture, scenario.measurement.encoders.cutoff)
    else:
        connect_joints(wiring.builder, plant, biped, targets)


def _add_pushes(wiring: Wiring, scenario: Scenario, biped: Biped, plant: MultibodyPlant) -> None:
    if not scenario.pushes and not any(scenario.wind):
        return
    push = wiring.add("push_schedule", PushSchedule(timed_forces(scenario, (plant, biped)), wiring.tick))
    applied = plant.get_applied_spatial_force_input_port()
    wiring.builder.Connect(push.GetOutputPort("applied_spatial_force"), applied)
    wiring.log("push")
