"""The controller's model of the robot: a multibody plant of its own, with joint order, limits, gains and soles."""

from __future__ import annotations

import math
from copy import copy
from typing import NamedTuple

import numpy as np
from pydrake.math import RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, JointActuator, ModelInstanceIndex, RigidBody, SpatialInertia
from pydrake.systems.framework import Context

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.robot.config import SIDES, RobotConfig
from pdhocbf_drake.robot.faults import Fault, faults_in
from pdhocbf_drake.robot.locate import load_robot_config
from pdhocbf_drake.robot.model import add_model, find_joint, sole_frame_name, torso_frame
from pdhocbf_drake.robot.multibody.tree import tree_of
from pdhocbf_drake.robot.per_joint import per_joint
from pdhocbf_drake.robot.straight_pose import StraightPose

_STIFFNESS = 3.64  # of a joint, over m g z [1/rad]
_TIME = 0.137  # kd over kp, over √(z/g) [1]


class Sole(NamedTuple):
    """A sole: frame of the controller's model at its centre, half length and half width (2,) [m]."""

    frame: Frame
    half_size: np.ndarray


class Biped:
    """A floating base with two six-joint legs: q = [quaternion wxyz, base xyz, 12 joints], v = [ω, ẋ, 12 rates].

    Twelve-vectors are ordered left leg then right, each as in `ROLES`, whatever the model's own order is;
    `q_index`, `v_index` and `u_index` are their places in the plant's q, v and actuation.

    Attributes:
        config: the robot file.
        plant: the controller's copy of the model, continuous-time, without geometry and with nothing but the robot.
        mass: total mass [kg]. weight: its weight [N].
        joint_names: the model's names of the twelve joints.
        q_index, v_index, u_index: places of the twelve joints in q (19,), v (18,) and actuation (12,).
        base_q_index, base_v_index: places of the floating base in q (7,) and v (6,).
        effort_limits: (12,) [N m]; velocity_limits: (12,) [rad/s]; position_limits: (12, 2) [rad].
        kp, kd: gains (12,) [N m/rad, N m s/rad].
        soles: frame and half size of each sole.
        torso_frame: the frame that is kept upright. ahead: its x axis in the floating base (3,).
        tree: links, joints and the frames of torso, left and right sole for the kernels; None where they don't model
            all of the robot.
        bent_knee: q (19,) from which inverse kinematics starts.
    """

    def __init__(self, config: RobotConfig, checked: bool = True) -> None:
        """Loads the model.

        Args:
            config: the robot file.
            checked: whether sides, roles, bent knees and soles are checked against the model's geometry.

        Raises:
            ModelError: the model lacks a link, frame, joint or actuator (the message lists those it has), has moving
                joints beyond those of the legs, or contradicts the robot file, see `robot.faults`.
        """
        self.config = config
        self.plant = plant = MultibodyPlant(0.0)
        instance = add_model(plant, config)
        plant.Finalize()
        name = config.name
        base = _floating_base(plant, config)
        _check_joints(plant, instance, config)
        self.base_q_index = base.floating_positions_start() + np.arange(7)
        self.base_v_index = base.floating_velocities_start_in_v() + np.arange(6)
        joints = [find_joint(plant, instance, joint, name) for joint in config.joint_names]
        self.joint_names = config.joint_names
        self.q_index = np.array([joint.position_start() for joint in joints])
        self.v_index = np.array([joint.velocity_start() for joint in joints])
        actuators = self._actuators()
        self.u_index = np.array([actuators[joint].input_start() for joint in self.joint_names])
        self.effort_limits = np.array([actuators[joint].effort_limit() for joint in self.joint_names])
        self.velocity_limits = np.array([joint.velocity_upper_limit() for joint in joints])
        self.position_limits = np.array([[j.position_lower_limit(), j.position_upper_limit()] for j in joints])
        self.soles = {
            side: Sole(plant.GetFrameByName(sole_frame_name(side)), np.array(config.leg(side).sole.half_size))
            for side in SIDES
        }
        self.torso_frame = torso_frame(plant, instance, config)
        self._torso_inertia: SpatialInertia | None = None
        self._weigh()
        self.kp, self.kd = _gains(config, self.mass, self.weight)
        upright = self.torso_frame.CalcPose(plant.CreateDefaultContext(), base.body_frame()).rotation()
        self.ahead = upright.matrix()[:, 0]
        self.bent_knee = self._bent_knee(upright)
        if checked and (faults := [fault for fault in self.faults() if fault.fatal]):
            raise ModelError(f"robot {name!r}: {'; '.join(map(str, faults))}")

    @classmethod
    def load(cls, robot: str) -> Biped:
        """The robot of that name in the models folder, or of that robot YAML file."""
        return cls(load_robot_config(robot))

    def add_to(self, plant: MultibodyPlant) -> ModelInstanceIndex:
        """Adds the robot, with its geometry where the plant has a scene graph, to a plant to be simulated.

        As long as nothing else in that plant moves, q, v and actuation are ordered as in the controller's model.
        """
        return add_model(plant, self.config)

    def context(self) -> Context:
        """A context of `plant` with the masses that this robot is taken to have."""
        context = self.plant.CreateDefaultContext()
        if self._torso_inertia is not None:
            self.torso_frame.body().SetSpatialInertiaInBodyFrame(context, self._torso_inertia)
        return context

    def with_torso(self, inertia: SpatialInertia) -> Biped:
        """The same robot, for kinematics and dynamics, with a torso of this inertia about and in its body frame.

        Gains and limits stay.
        """
        other = copy(self)
        other._torso_inertia = inertia
        other._weigh()
        return other

    def _weigh(self) -> None:
        context = self.context()
        frames = [self.torso_frame, *(self.soles[side].frame for side in SIDES)]
        self.tree = tree_of(self.plant, frames, context)
        self.mass = float(self.plant.CalcTotalMass(context))
        self.weight = self.mass * float(np.linalg.norm(self.plant.gravity_field().gravity_vector()))

    def clipped(self, q: np.ndarray) -> np.ndarray:
        """A copy of q (19,) with the joints clipped to their limits and the quaternion normalized."""
        clipped = np.array(q, dtype=float)
        clipped[self.q_index] = np.clip(clipped[self.q_index], *self.position_limits.T)
        quaternion = self.base_q_index[:4]
        clipped[quaternion] /= max(float(np.linalg.norm(clipped[quaternion])), 1e-12)
        return clipped

    def faults(self) -> list[Fault]:
        """Entries of the robot file that the model's geometry contradicts."""
        soles = {side: sole.frame for side, sole in self.soles.items()}
        return faults_in(StraightPose(self.plant, self.config, soles, self.bent_knee, self.q_index))

    def _actuators(self) -> dict[str, JointActuator]:
        actuators = (self.plant.get_joint_actuator(index) for index in self.plant.GetJointActuatorIndices())
        return {actuator.joint().name(): actuator for actuator in actuators}

    def _bent_knee(self, upright: RotationMatrix) -> np.ndarray:
        q = np.zeros(self.plant.num_positions())
        q[self.base_q_index[:4]] = upright.inverse().ToQuaternion().wxyz()
        q[self.base_q_index[6]] = self.config.com_height
        angles = [list(self.config.leg(side).bent_knee.model_dump().values()) for side in SIDES]
        q[self.q_index] = np.ravel(angles)
        return self.clipped(q)


def _gains(config: RobotConfig, mass: float, weight: float) -> tuple[np.ndarray, np.ndarray]:
    """kp and kd (12,); where they are not given, a stiffness and a time constant that fit the robot's weight."""
    kp = per_joint(_STIFFNESS * weight * config.com_height if config.kp is None else config.kp)
    time = _TIME * math.sqrt(config.com_height * mass / weight)
    return kp, time * kp if config.kd is None else per_joint(config.kd)


def _floating_base(plant: MultibodyPlant, config: RobotConfig) -> RigidBody:
    """The one floating link; raises `ModelError` where that is not `base_link`."""
    floating = [plant.get_body(index) for index in sorted(plant.GetFloatingBaseBodies(), key=int)]
    names = [body.name() for body in floating]
    if names != [config.base_link] or not floating[0].has_quaternion_dofs():
        raise ModelError(
            f"robot {config.name!r}: base_link {config.base_link!r} must be the one floating link; "
            f"floating are: {', '.join(names) or 'none'}"
        )
    return floating[0]


def _check_joints(plant: MultibodyPlant, instance: ModelInstanceIndex, config: RobotConfig) -> None:
    """Raises `ModelError` where anything but the floating base and the legs' joints moves."""
    joints = [plant.get_joint(index) for index in plant.GetJointIndices(instance)]
    extra = {joint.name() for joint in joints if joint.num_velocities() == 1} - set(config.joint_names)
    if extra or plant.num_velocities() != 6 + len(config.joint_names):
        raise ModelError(
            f"robot {config.name!r} has moving joints beyond the twelve of its legs: "
            f"{', '.join(sorted(extra)) or 'none with a name'}; give each an angle in fixed_joints"
        )
