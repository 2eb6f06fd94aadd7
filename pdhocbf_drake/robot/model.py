"""Adds a robot model to a `MultibodyPlant`: parses it, welds its fixed joints, completes its actuators."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    Joint,
    JointActuator,
    ModelInstanceIndex,
    PrismaticJoint,
    RevoluteJoint,
    WeldJoint,
)

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.robot.config import SIDES, RobotConfig, Side, SoleConfig
from pdhocbf_drake.robot.contact import stand_on_spheres
from pdhocbf_drake.robot.foot_points import foot_points
from pdhocbf_drake.robot.model_text import JointText, joint_texts
from pdhocbf_drake.robot.parsing import listed, parse_model
from pdhocbf_drake.robot.per_joint import per_joint
from pdhocbf_drake.robot.sole_check import sole_fault

_UPRIGHT = "torso_upright"


def add_model(plant: MultibodyPlant, config: RobotConfig) -> ModelInstanceIndex:
    """Adds the robot to a plant that is not finalized.

    The plant gets frames `left_sole_centre` and `right_sole_centre`; joints in `fixed_joints` are welded;
    limits and reflected inertias of the config replace the model's, and where the plant has a scene graph,
    four spheres at the corners of each sole the feet's contact geometry.

    Raises:
        ModelError: a file, link, joint, frame or actuator is missing, the message lists the existing ones; or a
            declared sole does not fit the geometry of its foot.
    """
    instance = parse_model(plant, config)
    _weld(plant, instance, config)
    _complete_actuators(plant, instance, config)
    for side in SIDES:
        sole = config.leg(side).sole
        link = find_frame(plant, instance, sole.link, config.name)
        plant.AddFrame(FixedOffsetFrame(sole_frame_name(side), link, _pose(sole), instance))
    if any(config.torso_rpy):
        upright = RigidTransform(RollPitchYaw(config.torso_rpy), np.zeros(3))
        plant.AddFrame(FixedOffsetFrame(_UPRIGHT, _torso_link(plant, instance, config), upright, instance))
    if plant.geometry_source_is_registered():
        _stand_on_soles(plant, instance, config)
    return instance


def torso_frame(plant: MultibodyPlant, instance: ModelInstanceIndex, config: RobotConfig) -> Frame:
    """The frame that is kept upright, x ahead and z up, in a plant that `add_model` has added the robot to."""
    if any(config.torso_rpy):
        return plant.GetFrameByName(_UPRIGHT, instance)
    return _torso_link(plant, instance, config)


def _torso_link(plant: MultibodyPlant, instance: ModelInstanceIndex, config: RobotConfig) -> Frame:
    return find_frame(plant, instance, config.torso_link or config.base_link, config.name)


def _stand_on_soles(plant: MultibodyPlant, instance: ModelInstanceIndex, config: RobotConfig) -> None:
    """Checks the soles against the feet's geometry, and puts spheres at their corners unless `keep_contact`."""
    scene_graph = Parser(plant).scene_graph()
    for side in SIDES:
        frame = plant.GetFrameByName(sole_frame_name(side), instance)
        half_size = config.leg(side).sole.half_size
        points, what = foot_points(plant, scene_graph, frame)
        if fault := sole_fault(points, np.array(half_size)):
            raise ModelError(f"robot {config.name!r}: {side}.sole does not fit the {what} of the foot: {fault}")
        if not config.keep_contact:
            stand_on_spheres(plant, scene_graph, frame, half_size)


def sole_frame_name(side: Side) -> str:
    """Name of the frame at the centre of a sole, x forward, z up."""
    return f"{side}_sole_centre"


def find_frame(plant: MultibodyPlant, instance: ModelInstanceIndex, name: str, robot: str) -> Frame:
    """A link's frame or a named frame of the model."""
    if plant.HasFrameNamed(name, instance):
        return plant.GetFrameByName(name, instance)
    joints = [plant.get_joint(index).name() for index in plant.GetJointIndices(instance)]
    parsers_own = {f"{joint}_{end}" for joint in joints for end in ("parent", "child")}
    there = {plant.get_frame(index).name() for index in plant.GetFrameIndices(instance)} - parsers_own
    raise ModelError(f"robot {robot!r} has no link or frame {name!r}; there are: {listed(there)}")


def find_joint(plant: MultibodyPlant, instance: ModelInstanceIndex, name: str, robot: str) -> Joint:
    """A joint of the model."""
    if plant.HasJointNamed(name, instance):
        return plant.GetJointByName(name, instance)
    joints = (plant.get_joint(index) for index in plant.GetJointIndices(instance))
    there = (joint.name() for joint in joints if joint.num_velocities() == 1)
    raise ModelError(f"robot {robot!r} has no joint {name!r}; its moving joints are: {listed(there)}")


def _weld(plant: MultibodyPlant, instance: ModelInstanceIndex, config: RobotConfig) -> None:
    joints = {name: find_joint(plant, instance, name, config.name) for name in config.fixed_joints}
    _drop_mimics(plant, config)
    for name, value in config.fixed_joints.items():
        joint = joints[name]
        for actuator in _actuators(plant, instance):
            if actuator.joint().index() == joint.index():
                plant.RemoveJointActuator(actuator)
        if joint.type_name() == RevoluteJoint.kTypeName:
            pose = RigidTransform(AngleAxis(value, joint.revolute_axis()), np.zeros(3))
        elif joint.type_name() == PrismaticJoint.kTypeName:
            pose = RigidTransform(value * joint.translation_axis())
        elif joint.type_name() == WeldJoint.kTypeName and value == 0.0:
            continue
        else:
            kinds = "a joint that the model fixes may stand there with 0 alone" if joint.num_velocities() == 0 else ""
            raise ModelError(
                f"robot {config.name!r}: fixed_joints may hold revolute or prismatic joints, "
                f"{name!r} is of type {joint.type_name()!r}{kinds and '; ' + kinds}"
            )
        parent, child = joint.frame_on_parent(), joint.frame_on_child()
        plant.RemoveJoint(joint)
        plant.AddJoint(WeldJoint(f"{name}_weld", parent, child, pose))


def _drop_mimics(plant: MultibodyPlant, config: RobotConfig) -> None:
    """Removes the constraints of joints in `fixed_joints` that follow others; refuses those of the legs' joints."""
    if plant.num_constraints() == 0:
        return
    leaders = {name: text.leader for name, text in joint_texts(Path(config.model)).items() if text.leader}
    for name in config.joint_names:
        if name in leaders:
            raise ModelError(
                f"robot {config.name!r}: joint {name!r} of a leg follows {leaders[name]!r} in the model (mimic), "
                "but each joint of a leg needs a motor of its own"
            )
    if plant.num_constraints() > len(leaders):
        raise ModelError(f"robot {config.name!r}: {config.model} holds closed loops of links, and none are allowed")
    for constraint in plant.GetConstraintIds():
        plant.RemoveConstraint(constraint)


def _complete_actuators(plant: MultibodyPlant, instance: ModelInstanceIndex, config: RobotConfig) -> None:
    actuators = {actuator.joint().name(): actuator for actuator in _actuators(plant, instance)}
    joints = {name: find_joint(plant, instance, name, config.name) for name in config.joint_names}
    efforts = None if config.effort_limits is None else per_joint(config.effort_limits)
    if efforts is None and not set(config.joint_names) <= set(actuators):
        efforts = _model_efforts(config, actuators)
    inertias = None if config.reflected_inertia is None else per_joint(config.reflected_inertia)
    speeds = None if config.velocity_limits is None else per_joint(config.velocity_limits)
    for number, (name, joint) in enumerate(joints.items()):
        actuator = actuators.get(name) or plant.AddJointActuator(f"{name}_actuator", joint)
        if efforts is not None:
            actuator.set_effort_limit(efforts[number])
        if speeds is not None:
            joint.set_velocity_limits([-speeds[number]], [speeds[number]])
        if inertias is not None:
            actuator.set_default_gear_ratio(1.0)
            actuator.set_default_rotor_inertia(inertias[number])
        if not math.isfinite(actuator.effort_limit()):
            # Without a limit the torques of a falling robot grow until the simulation ends in NaN.
            raise ModelError(f"robot {config.name!r}: joint {name!r} has no effort limit; give effort_limits [N m]")


def _model_efforts(config: RobotConfig, actuators: Mapping[str, JointActuator]) -> np.ndarray:
    """Effort limits (12,) [N m] of the model's actuators, and of its `<limit>` tags where a joint has no actuator."""
    texts = joint_texts(Path(config.model))
    efforts = []
    for name in config.joint_names:
        effort = actuators[name].effort_limit() if name in actuators else texts.get(name, JointText()).effort
        if effort is None or effort <= 0.0:
            what = "has no actuators" if not actuators else f"has no actuator on joint {name!r}"
            there = f"; actuated joints are: {listed(actuators)}" if actuators else ""
            raise ModelError(
                f"robot {config.name!r} {what}, and joint {name!r} has no effort in its <limit>: add it to "
                f"{config.model} or give effort_limits [N m] in the robot file{there}"
            )
        efforts.append(effort)
    return np.array(efforts)


def _actuators(plant: MultibodyPlant, instance: ModelInstanceIndex) -> list[JointActuator]:
    # Drake's list of a model instance's actuators is empty until the plant is finalized.
    every = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    return [actuator for actuator in every if actuator.model_instance() == instance]


def _pose(sole: SoleConfig) -> RigidTransform:
    return RigidTransform(RollPitchYaw(sole.rpy), sole.xyz)
