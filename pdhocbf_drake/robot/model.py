"""Adds a robot model to a `MultibodyPlant`: parses it, welds its fixed joints, completes its actuators."""

from __future__ import annotations

import math
from collections.abc import Iterable
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
from pdhocbf_drake.robot.config import ROLES, SIDES, RobotConfig, Side, SoleConfig


def add_model(plant: MultibodyPlant, config: RobotConfig) -> ModelInstanceIndex:
    """Adds the robot to a plant that is not finalized.

    The plant gets frames `left_sole_centre` and `right_sole_centre`; joints in `fixed_joints` are welded;
    effort limits and reflected inertias of the config replace the model's.

    Raises:
        ModelError: a file, link, joint, frame or actuator is missing; the message lists the existing ones.
    """
    instance = _parse(plant, config)
    _weld(plant, instance, config)
    _complete_actuators(plant, instance, config)
    for side in SIDES:
        sole = config.leg(side).sole
        plant.AddFrame(
            FixedOffsetFrame(
                sole_frame_name(side),
                find_frame(plant, instance, sole.link, config.name),
                _pose(sole),
                instance,
            )
        )
    return instance


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
    raise ModelError(f"robot {robot!r} has no link or frame {name!r}; there are: {_listed(there)}")


def find_joint(plant: MultibodyPlant, instance: ModelInstanceIndex, name: str, robot: str) -> Joint:
    """A joint of the model."""
    if plant.HasJointNamed(name, instance):
        return plant.GetJointByName(name, instance)
    joints = (plant.get_joint(index) for index in plant.GetJointIndices(instance))
    there = (joint.name() for joint in joints if joint.num_velocities() == 1)
    raise ModelError(f"robot {robot!r} has no joint {name!r}; its moving joints are: {_listed(there)}")


def per_joint(value: object) -> np.ndarray:
    """A per-joint value of a `RobotConfig` as twelve numbers, left leg then right."""
    return np.tile(np.broadcast_to(np.asarray(value, dtype=float), len(ROLES)), len(SIDES))


def _parse(plant: MultibodyPlant, config: RobotConfig) -> ModelInstanceIndex:
    path = Path(config.model)
    if not path.is_file():
        models = (other.name for other in path.parent.glob("*.*") if other.suffix in {".urdf", ".sdf", ".xml"})
        raise ModelError(
            f"robot {config.name!r}: no model file {path}; model files in that folder: {_listed(models) or 'none'}"
        )
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    for name, folder in config.packages.items():
        if not Path(folder).is_dir():
            raise ModelError(f"robot {config.name!r}: packages.{name}: there is no folder {folder}")
        parser.package_map().Add(name, folder)
    try:
        instances = parser.AddModels(path)
    except RuntimeError as error:
        raise ModelError(f"robot {config.name!r}: {path} can't be read: {str(error).splitlines()[0]}") from None
    if len(instances) != 1:
        raise ModelError(f"robot {config.name!r}: {path} holds {len(instances)} models, one is allowed")
    return instances[0]


def _weld(plant: MultibodyPlant, instance: ModelInstanceIndex, config: RobotConfig) -> None:
    for name, angle in config.fixed_joints.items():
        joint = find_joint(plant, instance, name, config.name)
        for actuator in _actuators(plant, instance):
            if actuator.joint().index() == joint.index():
                plant.RemoveJointActuator(actuator)
        if joint.type_name() == RevoluteJoint.kTypeName:
            pose = RigidTransform(AngleAxis(angle, joint.revolute_axis()), np.zeros(3))
        elif joint.type_name() == PrismaticJoint.kTypeName:
            pose = RigidTransform(angle * joint.prismatic_axis())
        else:
            raise ModelError(
                f"robot {config.name!r}: fixed_joints may hold revolute or prismatic joints, "
                f"{name!r} is of type {joint.type_name()!r}"
            )
        parent, child = joint.frame_on_parent(), joint.frame_on_child()
        plant.RemoveJoint(joint)
        plant.AddJoint(WeldJoint(f"{name}_weld", parent, child, pose))


def _complete_actuators(plant: MultibodyPlant, instance: ModelInstanceIndex, config: RobotConfig) -> None:
    actuators = {actuator.joint().name(): actuator for actuator in _actuators(plant, instance)}
    efforts = None if config.effort_limits is None else per_joint(config.effort_limits)
    inertias = None if config.reflected_inertia is None else per_joint(config.reflected_inertia)
    for number, name in enumerate(config.joint_names):
        joint = find_joint(plant, instance, name, config.name)
        if name not in actuators and efforts is None:
            what = "has no actuators" if not actuators else f"has no actuator on joint {name!r}"
            there = f"; actuated joints are: {_listed(actuators)}" if actuators else ""
            raise ModelError(
                f"robot {config.name!r} {what}: add transmissions to {config.model} "
                f"or give effort_limits [N m] in the robot file{there}"
            )
        actuator = actuators.get(name) or plant.AddJointActuator(f"{name}_actuator", joint)
        if efforts is not None:
            actuator.set_effort_limit(efforts[number])
        if inertias is not None:
            actuator.set_default_gear_ratio(1.0)
            actuator.set_default_rotor_inertia(inertias[number])
        if not math.isfinite(actuator.effort_limit()):
            # Without a limit the torques of a falling robot grow until the simulation ends in NaN.
            raise ModelError(f"robot {config.name!r}: joint {name!r} has no effort limit; give effort_limits [N m]")


def _actuators(plant: MultibodyPlant, instance: ModelInstanceIndex) -> list[JointActuator]:
    # Drake's list of a model instance's actuators is empty until the plant is finalized.
    every = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    return [actuator for actuator in every if actuator.model_instance() == instance]


def _pose(sole: SoleConfig) -> RigidTransform:
    return RigidTransform(RollPitchYaw(sole.rpy), sole.xyz)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(sorted(name for name in names if name))
