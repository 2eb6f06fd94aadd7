"""The robot's rigid links and joints as two arrays, read from its `MultibodyPlant`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, QuaternionFloatingJoint, RevoluteJoint, RigidBody, WeldJoint
from pydrake.systems.framework import Context

from pdhocbf_drake.robot.multibody.kernels import CARRIED, DAMPING, INERTIA, MASS, MOMENT, OFFSET, ROTOR

_KNOWN = QuaternionFloatingJoint | RevoluteJoint | WeldJoint
_NO_JOINT = (-1, -1)


class Tree(NamedTuple):
    """A floating base that carries links on revolute joints, and frames fixed to them, for the kernels.

    Bodies that are welded together are one link. Its origin and axes are those of its joint's frame, turned such that
    z is the joint's axis.

    Attributes:
        links: parent, place in q and place in v of each link, parents before their children, (n, 3).
        numbers: pose in the parent at angle 0, mass, inertia, damping, reflected inertia, see `kernels`, (n, 25).
        lift: minus the acceleration of gravity (3,) [m/s²].
    """

    links: np.ndarray
    numbers: np.ndarray
    lift: tuple[float, float, float]


def tree_of(plant: MultibodyPlant, frames: Sequence[Frame], context: Context | None = None) -> Tree | None:
    """The robot in a plant that holds nothing else, with frames of interest; None where the kernels don't model it.

    Masses are those of the context, whose positions are set; those of the model by default.

    They have one floating base, welds, and revolute joints that lead away from the base, with damping and reflected
    inertia; but no springs or other force elements than gravity.
    """
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    bases = [joint for joint in joints if isinstance(joint, QuaternionFloatingJoint)]
    if len(bases) != 1 or not all(isinstance(joint, _KNOWN) for joint in joints) or not _is_plain(plant, bases[0]):
        return None
    base, context = bases[0], context or plant.CreateDefaultContext()
    _set_zero(plant, base, context)
    links = [(-1, base.position_start(), base.velocity_start())]
    poses = [base.frame_on_child().CalcPoseInWorld(context)]
    numbers = [_numbers(plant, context, base.frame_on_child(), RigidTransform(), RotationMatrix())]
    link_of = dict.fromkeys(_welded(plant, base.child_body()), 0)
    waiting = [joint for joint in joints if isinstance(joint, RevoluteJoint)]
    while joint := next((joint for joint in waiting if joint.parent_body().index() in link_of), None):
        waiting.remove(joint)
        parent, turn = link_of[joint.parent_body().index()], RotationMatrix.MakeFromOneVector(joint.revolute_axis(), 2)
        pose = joint.frame_on_child().CalcPoseInWorld(context) @ RigidTransform(turn)
        row = _numbers(plant, context, joint.frame_on_child(), poses[parent].InvertAndCompose(pose), turn)
        row[DAMPING], row[ROTOR] = joint.default_damping(), _reflected_inertia(plant, context, joint)
        link_of |= dict.fromkeys(_welded(plant, joint.child_body()), len(links))
        links.append((parent, joint.position_start(), joint.velocity_start()))
        poses.append(pose)
        numbers.append(row)
    if len(link_of) != plant.num_bodies() - 1 or any(frame.body().index() not in link_of for frame in frames):
        return None
    for row, (parent, *_) in zip(reversed(numbers), reversed(links), strict=True):
        row[CARRIED] += row[MASS]
        if parent >= 0:
            numbers[parent][CARRIED] += row[CARRIED]
    for frame in frames:
        link = link_of[frame.body().index()]
        links.append((link, *_NO_JOINT))
        numbers.append(_with_pose(poses[link].InvertAndCompose(frame.CalcPoseInWorld(context))))
    return Tree(np.array(links), np.array(numbers), tuple((-plant.gravity_field().gravity_vector()).tolist()))


def _is_plain(plant: MultibodyPlant, base: QuaternionFloatingJoint) -> bool:
    """Whether the base's coordinates are its pose in the world, without damping, and gravity is the one force."""
    falls = all(
        plant.is_gravity_enabled(joint.model_instance()) for joint in map(plant.get_joint, plant.GetJointIndices())
    )
    free = base.frame_on_parent().is_world_frame() and not np.any(base.default_damping_vector())
    return bool(free and falls and plant.num_force_elements() == 1)


def _set_zero(plant: MultibodyPlant, base: QuaternionFloatingJoint, context: Context) -> None:
    """Sets all angles to 0 and the base to the world's origin."""
    q = np.zeros(plant.num_positions())
    q[base.position_start()] = 1.0
    plant.SetPositions(context, q)


def _welded(plant: MultibodyPlant, body: RigidBody) -> list[int]:
    """Indices of the bodies that are welded to a body, its own one included."""
    return [other.index() for other in plant.GetBodiesWeldedTo(body)]


def _with_pose(pose: RigidTransform) -> np.ndarray:
    """A row of `Tree.numbers` with a pose and no mass."""
    row = np.zeros(CARRIED + 1)
    row[:OFFSET], row[OFFSET:MASS] = pose.rotation().matrix().ravel(), pose.translation()
    return row


def _numbers(
    plant: MultibodyPlant, context: Context, frame: Frame, pose: RigidTransform, turn: RotationMatrix
) -> np.ndarray:
    """A row of `Tree.numbers`, for a joint's frame on the link and the link's axes in that frame."""
    row, axes = _with_pose(pose), turn.matrix()
    inertia = plant.CalcSpatialInertia(context, frame, _welded(plant, frame.body()))
    about = axes.T @ inertia.CalcRotationalInertia().CopyToFullMatrix3() @ axes
    row[MASS], row[MOMENT:INERTIA] = inertia.get_mass(), axes.T @ inertia.CalcComMoment()
    row[INERTIA:DAMPING] = *np.diag(about), about[0, 1], about[0, 2], about[1, 2]
    return row


def _reflected_inertia(plant: MultibodyPlant, context: Context, joint: RevoluteJoint) -> float:
    """Of all actuators of a joint [kg m²]."""
    actuators = map(plant.get_joint_actuator, plant.GetJointActuatorIndices())
    return sum(a.calc_reflected_inertia(context) for a in actuators if a.joint().index() == joint.index())
