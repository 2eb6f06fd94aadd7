"""The robot's kinematics and dynamics by kernels: equal to Drake's, for any robot that they model, and for no other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from biped_cases import biped, random_posture
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RevoluteSpring,
    SpatialInertia,
)
from random_robots import random_robot

from pdhocbf_drake.robot import Biped, InverseDynamics, WholeBodyIk
from pdhocbf_drake.robot.drake_task_space import DrakeTaskSpace
from pdhocbf_drake.robot.multibody.tree import tree_of
from pdhocbf_drake.robot.posture import TargetPoses
from pdhocbf_drake.robot.task_space import TaskSpace
from pdhocbf_drake.robot.tree_task_space import TreeTaskSpace, task_space_of

Quantity = Callable[[TaskSpace, np.ndarray, np.ndarray, np.ndarray], np.ndarray]

QUANTITIES: dict[str, Quantity] = {
    "poses": lambda task, q, v, vdot: task.poses(),
    "velocity of the CoM": lambda task, q, v, vdot: task.com_velocity(),
    "Jacobian": lambda task, q, v, vdot: task.jacobian(),
    "bias": lambda task, q, v, vdot: task.bias(),
    "forces": lambda task, q, v, vdot: task.forces(vdot),
    "moved": lambda task, q, v, vdot: task.moved(q, 0.3 * v),
}


def random_motion(robot: Biped, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q, v and v̇: any place and orientation of the base, angles within the limits."""
    q = random.normal(size=19)
    q[robot.base_q_index[:4]] /= np.linalg.norm(q[robot.base_q_index[:4]])
    q[robot.q_index] = random.uniform(*robot.position_limits.T)
    return q, random.normal(size=18), 5.0 * random.normal(size=18)


def kernels_of(robot: Biped) -> TreeTaskSpace:
    """The robot's task space by kernels."""
    task = task_space_of(robot)
    assert isinstance(task, TreeTaskSpace)
    return task


def assert_equal(robot: Biped, seed: int, motions: int = 20) -> None:
    """Everything that Drake computes, to twelve digits."""
    ours, drakes, random = kernels_of(robot), DrakeTaskSpace(robot), np.random.default_rng(seed)
    for _ in range(motions):
        q, v, vdot = random_motion(robot, random)
        for task in (ours, drakes):
            task.set_state(q, v)
        for name, quantity in QUANTITIES.items():
            found, expected = quantity(ours, q, v, vdot), quantity(drakes, q, v, vdot)
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * abs(expected).max(), err_msg=name)


def test_the_packaged_robot() -> None:
    assert_equal(biped(), 0, 100)


@pytest.mark.parametrize("seed", range(12))
def test_robots_of_any_axes_orders_and_welded_parts(seed: int, tmp_path: Path) -> None:
    assert_equal(random_robot(tmp_path, seed), seed)


def test_inverse_kinematics_takes_the_same_steps() -> None:
    random = np.random.default_rng(1)
    ours, drakes = kernels_of(biped()), DrakeTaskSpace(biped())
    given_up = 0
    for _ in range(40):
        goal = TargetPoses.of(random_posture(random))
        q, *_ = random_motion(biped(), random)
        seed = np.where(random.random() < 0.7, biped().bent_knee, biped().clipped(q))
        (q, steps, worst), (drakes_q, *same) = ours.approach(goal, seed), drakes.approach(goal, seed)
        given_up += worst == np.inf
        assert steps == same[0]
        assert (worst == np.inf) == (same[1] == np.inf)
        np.testing.assert_allclose(q, drakes_q, atol=1e-9)
    assert 0 < given_up < 40


def test_the_motion_that_follows_a_posture() -> None:
    random = np.random.default_rng(2)
    ours, drakes = kernels_of(biped()), DrakeTaskSpace(biped())
    ik, fastest = WholeBodyIk(biped()), 0.0
    for scale in (0.3, 0.3, 0.3, 3.5):
        q = ik.solve(random_posture(random), biped().bent_knee).q
        rates, accelerations = scale * random.normal(size=(2, 18))
        found, expected = ours.follow(q, rates, accelerations), drakes.follow(q, rates, accelerations)
        assert found is not None
        assert expected is not None
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
        speeds = abs(found[0][biped().v_index]) / biped().velocity_limits
        fastest = max(fastest, speeds.max())
    assert fastest == 1.0  # the last one is at a limit
    straight = np.array(biped().bent_knee)
    straight[biped().q_index] = 0.0
    assert ours.follow(straight, np.ones(18), np.ones(18)) is None
    assert drakes.follow(straight, np.ones(18), np.ones(18)) is None


def test_what_is_kept_for_the_last_posture_is_never_that_of_another() -> None:
    random = np.random.default_rng(3)
    task, ik = kernels_of(biped()), WholeBodyIk(biped())
    posture = random_posture(random)
    goal, near = TargetPoses.of(posture), ik.solve(posture, biped().bent_knee).q
    for _ in range(5):
        q, v, vdot = random_motion(biped(), random)
        for method, arguments in (
            (task.approach, (goal, near)), (task.approach, (goal, biped().bent_knee)), (task.follow, (near, v, vdot)),
            (task.moved, (near, v)),
        ):  # fmt: skip
            method(*arguments)
            task.set_state(q, v)
            fresh = DrakeTaskSpace(biped())
            fresh.set_state(q, v)
            for name, quantity in QUANTITIES.items():
                expected = quantity(fresh, q, v, vdot)
                np.testing.assert_allclose(
                    quantity(task, q, v, vdot), expected, rtol=1e-12, atol=1e-12 * abs(expected).max(), err_msg=name
                )


def test_a_robot_with_sliding_knees_is_left_to_drake(tmp_path: Path) -> None:
    robot = random_robot(tmp_path, 5, knee="prismatic")
    assert robot.tree is None
    assert isinstance(task_space_of(robot), DrakeTaskSpace)
    random = np.random.default_rng(0)
    q, v, vdot = random_motion(robot, random)
    torques, *_ = InverseDynamics(robot)(q, v, vdot, 0.5)
    assert np.isfinite(torques).all()
    assert np.isfinite(WholeBodyIk(robot).solve(random_posture(random), q).q).all()


def _robot(plant: MultibodyPlant) -> tuple[RevoluteJoint, QuaternionFloatingJoint | None]:
    base, link = (
        plant.AddRigidBody(name, SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1)) for name in ("base", "link")
    )
    return plant.AddJoint(RevoluteJoint("joint", base.body_frame(), link.body_frame(), [0, 0, 1])), None


def _plain(plant: MultibodyPlant) -> None:
    _robot(plant)


def _spring(plant: MultibodyPlant) -> None:
    joint, _ = _robot(plant)
    plant.AddForceElement(RevoluteSpring(joint, 0.0, 10.0))


def _slide(plant: MultibodyPlant) -> None:
    _robot(plant)
    tool = plant.AddRigidBody("tool", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
    plant.AddJoint(PrismaticJoint("slide", plant.GetBodyByName("link").body_frame(), tool.body_frame(), [0, 0, 1]))


def _two(plant: MultibodyPlant) -> None:
    _robot(plant)
    plant.AddRigidBody("ball", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))


def _fixed(plant: MultibodyPlant) -> None:
    _robot(plant)
    post = plant.AddRigidBody("post", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
    plant.WeldFrames(plant.world_frame(), post.body_frame())


def _weightless(plant: MultibodyPlant) -> None:
    _robot(plant)
    plant.set_gravity_enabled(plant.GetBodyByName("link").model_instance(), False)


def _based(plant: MultibodyPlant, damping: float, turned: bool) -> None:
    _robot(plant)
    world = plant.world_frame()
    if turned:
        from pydrake.math import RigidTransform, RollPitchYaw

        world = plant.AddFrame(FixedOffsetFrame("start", world, RigidTransform(RollPitchYaw(0, 0, 1), [1, 0, 0])))
    base = plant.GetBodyByName("base").body_frame()
    plant.AddJoint(QuaternionFloatingJoint("float", world, base, damping, damping))


@pytest.mark.parametrize(
    ("add", "modelled"),
    [
        (_plain, True), (_spring, False), (_slide, False), (_two, False), (_fixed, False), (_weightless, False),
        (lambda plant: _based(plant, 0.0, False), True), (lambda plant: _based(plant, 1.0, False), False),
        (lambda plant: _based(plant, 0.0, True), False),
    ],
)  # fmt: skip
def test_parts_that_the_kernels_do_not_model_are_noticed(add: Callable[[MultibodyPlant], None], modelled: bool) -> None:
    plant = MultibodyPlant(0.0)
    add(plant)
    plant.Finalize()
    frames = [plant.GetFrameByName(name) for name in ("base", "link", "link")]
    assert (tree_of(plant, frames) is not None) == modelled


def test_the_gravity_of_the_plant_counts() -> None:
    plant = MultibodyPlant(0.0)
    _robot(plant)
    plant.mutable_gravity_field().set_gravity_vector([0.1, 0.2, -3.0])
    plant.Finalize()
    tree = tree_of(plant, [plant.GetFrameByName("link")])
    assert tree is not None
    assert tree.lift == (-0.1, -0.2, 3.0)
