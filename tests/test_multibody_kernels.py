"""Every compiled loop of `pdhocbf_drake.robot.multibody` beside numpy or Drake; `test_multibody` tries many robots."""

from __future__ import annotations

import numpy as np
import pytest
from biped_cases import biped, random_posture, standing
from kernel_cases import Values, assert_agreement, by_name, kernels_of

from pdhocbf_drake.robot.damped import nearest_posture, row_weights
from pdhocbf_drake.robot.drake_task_space import DrakeTaskSpace
from pdhocbf_drake.robot.feedforward import InverseDynamics
from pdhocbf_drake.robot.ik import WholeBodyIk
from pdhocbf_drake.robot.multibody import kernels
from pdhocbf_drake.robot.posture import COM, LEFT, LEFT_TURN, RIGHT, RIGHT_TURN, TORSO_TURN, TargetPoses
from pdhocbf_drake.robot.tree_task_space import TreeTaskSpace

QUATERNION = 1


def three(random: np.random.Generator) -> tuple[float, float, float]:
    x, y, z = random.normal(size=3).tolist()
    return x, y, z


def with_nan(random: np.random.Generator, values: np.ndarray) -> np.ndarray:
    """The values, with NaN among them in a third of the cases."""
    if random.random() < 1 / 3:
        values[random.integers(len(values))] = np.nan
    return values


def vector(random: np.random.Generator) -> tuple[Values, Values]:
    table = random.normal(size=(3, 8))
    return (kernels.vector(table, 1, 4),), (table[1, 4:7],)


def store(random: np.random.Generator) -> tuple[Values, Values]:
    table, value = random.normal(size=(3, 8)), three(random)
    expected = table.copy()
    expected[2, 1:4] = value
    kernels.store(value, table, 2, 1)
    return (table,), (expected,)


def store_column(random: np.random.Generator) -> tuple[Values, Values]:
    table, value = random.normal(size=(5, 8)), three(random)
    expected = table.copy()
    expected[2:5, 1] = value
    kernels.store_column(value, table, 2, 1)
    return (table,), (expected,)


def plus(random: np.random.Generator) -> tuple[Values, Values]:
    a, b = three(random), three(random)
    return (kernels.plus(a, b),), (np.add(a, b),)


def times(random: np.random.Generator) -> tuple[Values, Values]:
    s, a = random.normal(), three(random)
    return (kernels.times(s, a),), (s * np.array(a),)


def cross(random: np.random.Generator) -> tuple[Values, Values]:
    a, b = three(random), three(random)
    return (kernels.cross(a, b),), (np.cross(a, b),)


def turned(random: np.random.Generator) -> tuple[Values, Values]:
    table, a = random.normal(size=(2, 9)), three(random)
    return (kernels.turned(table, 1, a),), (table[1].reshape(3, 3) @ a,)


def turned_back(random: np.random.Generator) -> tuple[Values, Values]:
    table, a = random.normal(size=(2, 9)), three(random)
    return (kernels.turned_back(table, 1, a),), (table[1].reshape(3, 3).T @ a,)


def times_inertia(random: np.random.Generator) -> tuple[Values, Values]:
    numbers, a = random.normal(size=(2, 25)), three(random)
    xx, yy, zz, xy, xz, yz = numbers[1, 16:22]
    return (kernels.times_inertia(numbers, 1, a),), (np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ a,)


def axis(random: np.random.Generator) -> tuple[Values, Values]:
    work = random.normal(size=(2, 9))
    return (kernels.axis(work, 1),), (work[1].reshape(3, 3)[:, 2],)


class Robot:
    """The packaged robot in a random motion: the arrays of the kernels, placed, and Drake's answers."""

    def __init__(self, random: np.random.Generator) -> None:
        self.drake = DrakeTaskSpace(biped())
        self.q, self.v, self.vdot = random.normal(size=19), random.normal(size=18), random.normal(size=18)
        self.q[:4] /= np.linalg.norm(self.q[:4])
        self.drake.set_state(self.q, self.v)
        assert biped().tree is not None
        self.links, self.numbers, self.lift = biped().tree
        self.work = np.full((len(self.links), kernels.WORK), np.nan)
        kernels.place(self.q, self.links, self.numbers, self.work)


def place(random: np.random.Generator) -> tuple[Values, Values]:
    robot = Robot(random)
    drakes, frames = robot.drake.poses()[3:].reshape(3, 3, 4), robot.work[-3:]
    return (
        frames[:, :9], frames[:, 9:12], robot.work[0, kernels.ALL_FIRST :][:3] / biped().mass,
    ), (drakes[:, :, :3].reshape(3, 9), drakes[:, :, 3], robot.drake.poses()[:3])  # fmt: skip


def write_poses(random: np.random.Generator) -> tuple[Values, Values]:
    robot, poses = Robot(random), np.empty(39)
    robot.work[:] = np.nan
    kernels.write_poses(robot.q, robot.links, robot.numbers, robot.work, poses)
    return (poses,), (robot.drake.poses(),)


def write_jacobian(random: np.random.Generator) -> tuple[Values, Values]:
    robot, jacobian = Robot(random), np.full((18, 18), np.nan)
    kernels.write_jacobian(robot.links, robot.numbers, robot.work, jacobian)
    return (jacobian,), (robot.drake.jacobian(),)


def accelerate(random: np.random.Generator) -> tuple[Values, Values]:
    robot = Robot(random)
    kernels.accelerate(robot.v, robot.vdot, (0.0, 0.0, 0.0), robot.links, robot.numbers, robot.work)
    rates = robot.drake.jacobian() @ robot.v
    changes = robot.drake.jacobian() @ robot.vdot + robot.drake.bias()
    turns = (TORSO_TURN, LEFT_TURN, RIGHT_TURN)
    work, frames = robot.work, robot.work[-3:]
    return (
        frames[:, kernels.OMEGA :][:, :3], frames[:, kernels.ALPHA :][:, :3],
        frames[1:, kernels.ACCELERATION :][:, :3], work[:, kernels.FORCE :][:, :3].sum(axis=0) / biped().mass,
    ), (
        [rates[turn] for turn in turns], [changes[turn] for turn in turns],
        [changes[LEFT], changes[RIGHT]], changes[COM],
    )  # fmt: skip


def write_bias(random: np.random.Generator) -> tuple[Values, Values]:
    robot, bias = Robot(random), np.empty(18)
    kernels.write_bias(robot.v, np.zeros(18), robot.links, robot.numbers, robot.work, bias)
    return (bias,), (robot.drake.bias(),)


def write_forces(random: np.random.Generator) -> tuple[Values, Values]:
    robot, forces = Robot(random), np.empty(18)
    kernels.write_forces(robot.v, robot.vdot, robot.lift, robot.links, robot.numbers, robot.work, forces)
    return (forces,), (robot.drake.forces(robot.vdot),)


def write_inertial_forces(random: np.random.Generator) -> tuple[Values, Values]:
    robot, forces, rest = Robot(random), np.empty((3, 18)), np.zeros(18)
    accelerations = random.normal(size=(3, 18))
    kernels.write_inertial_forces(accelerations, rest, robot.links, robot.numbers, robot.work, forces)
    robot.drake.set_state(robot.q, rest)
    still = robot.drake.forces(rest).copy()
    return (forces,), (np.array([robot.drake.forces(row) - still for row in accelerations]),)


def write_com_velocity(random: np.random.Generator) -> tuple[Values, Values]:
    robot, velocity = Robot(random), np.empty(3)
    kernels.write_com_velocity(robot.v, robot.links, robot.numbers, robot.work, velocity)
    return (velocity,), (robot.drake.com_velocity(),)


def write_poses_and_velocity(random: np.random.Generator) -> tuple[Values, Values]:
    robot, poses, velocity = Robot(random), np.empty(39), np.empty(3)
    kernels.write_poses_and_velocity(robot.q, robot.v, robot.links, robot.numbers, robot.work, poses, velocity)
    return (poses, velocity), (robot.drake.poses(), robot.drake.com_velocity())


def move(random: np.random.Generator) -> tuple[Values, Values]:
    robot, moved = Robot(random), np.empty(19)
    kernels.move(robot.q, robot.v, robot.links, moved)
    return (moved,), (robot.drake.moved(robot.q, robot.v),)


def factorize(random: np.random.Generator) -> tuple[Values, Values]:
    n = 7
    matrix, factors, pivots = random.normal(size=(n, n)), np.empty((n, n)), np.empty(n, dtype=np.int64)
    if random.random() < 0.3:
        matrix[:, 4] = 0.0 if random.random() < 0.5 else np.nan
    factors[:] = matrix
    if not kernels.factorize(factors, pivots):
        return (False,), (np.isfinite(matrix).all() and abs(np.linalg.det(matrix)) > 1e-12,)
    exchanged = matrix.copy()
    for k, other in enumerate(pivots):
        exchanged[[k, other]] = exchanged[[other, k]]
    product = (np.tril(factors, -1) + np.eye(n)) @ np.triu(factors)
    return (product, np.abs(np.tril(factors, -1)).max() <= 1.0), (exchanged, True)


def substitute(random: np.random.Generator) -> tuple[Values, Values]:
    matrix, right, pivots = random.normal(size=(18, 18)), random.normal(size=18), np.empty(18, dtype=np.int64)
    factors, x = matrix.copy(), np.empty(18)
    kernels.factorize(factors, pivots)
    kernels.substitute(factors, pivots, right, x)
    return (matrix @ x,), (right,)


def within_limits(random: np.random.Generator) -> tuple[Values, Values]:
    joints, lower, upper = np.array([5, 6]), np.array([-1.0, -2.0]), np.array([1.0, 2.0])
    q = random.uniform(-1.3, 1.3, 7)
    quaternion = q[QUATERNION : QUATERNION + 4]
    if random.random() < 0.7:
        quaternion /= np.linalg.norm(quaternion)
    q = with_nan(random, q)
    inside = ((q[joints] >= lower) & (q[joints] <= upper)).all() and abs(np.linalg.norm(quaternion) - 1.0) < 1e-12
    return (kernels.within_limits(q, joints, lower, upper, QUATERNION),), (inside,)


def limit(random: np.random.Generator) -> tuple[Values, Values]:
    vector, places, most = with_nan(random, random.normal(size=9)), np.array([1, 8, 5]), random.uniform(0.1, 2.0, 3)
    expected = vector.copy()
    expected[places] = np.clip(vector[places], -most, most)
    kernels.limit(vector, places, most)
    return (vector,), (expected,)


def largest(random: np.random.Generator) -> tuple[Values, Values]:
    vector = with_nan(random, random.normal(size=6))
    return (kernels.largest(vector),), (np.abs(vector).max(),)


def write_error(random: np.random.Generator) -> tuple[Values, Values]:
    rows, offset, poses = random.normal(size=(21, 39)), random.normal(size=18), random.normal(size=39)
    rows[:18], largest = 0.0, random.choice([0.05, 1.0, 3.1])
    angles, axes = largest * random.uniform(0.9, 1.0, 3), random.normal(size=(3, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    rows[18:] *= ((1.0 + 2.0 * np.cos(angles)) / (rows[18:] @ poses))[:, None]
    expected = offset.copy()
    for turn, axis, angle in zip((TORSO_TURN, LEFT_TURN, RIGHT_TURN), axes, angles, strict=True):
        offset[turn] = np.sin(angle) * axis
        expected[turn] = (np.sin(angle) if largest < 0.1 else angle) * axis
    out = np.empty(18)
    told = kernels.write_error(rows, offset, poses, out)
    offset[LEFT_TURN] = 0.0  # the second trace says half a revolution
    rows[19] *= -1.0 / (rows[19] @ poses)
    return (told, out, kernels.write_error(rows, offset, poses, np.empty(18))), (True, expected, False)


def write_product(random: np.random.Generator) -> tuple[Values, Values]:
    a, b, out = random.normal(size=(4, 4)), random.normal(size=(4, 4)), np.full((4, 4), np.nan)
    a[random.random((4, 4)) < 0.3] = 0.0
    kernels.write_product(a, b, out)
    return (out,), (a @ b,)


def weigh(random: np.random.Generator) -> tuple[Values, Values]:
    weights, error, weighted = random.normal(size=(18, 18)), random.normal(size=18), np.full(18, np.nan)
    square = kernels.weigh(weights, error, weighted)
    return (weighted, square), (weights @ error, np.linalg.norm(weights @ error) ** 2)


def clip_joints(random: np.random.Generator) -> tuple[Values, Values]:
    q, joints, bounds = random.normal(size=9), random.permutation(9)[:4], np.sort(random.normal(size=(2, 4)), axis=0)
    expected = q.copy()
    expected[joints] = np.clip(q[joints], *bounds)
    kernels.clip_joints(q, joints, *bounds)
    return (q,), (expected,)


def descend(random: np.random.Generator) -> tuple[Values, Values]:
    """The nearest posture is that of the steps in numpy, from Drake's kinematics."""
    posture = standing(random.uniform(0.5, 0.72))
    posture.com[:2] += random.uniform(-0.05, 0.05, 2)
    goal, weights = TargetPoses.of(posture), row_weights(None if random.random() < 0.5 else "left")
    expected, error, steps = nearest_posture(biped(), DrakeTaskSpace(biped()), goal, biped().bent_knee, weights)
    robot, q = Robot(random), np.array(biped().bent_knee)
    room = (
        np.empty(39), np.empty((5, 18)), np.empty(19), np.empty((3, 18, 18)), np.empty(18, dtype=np.int64),
    )  # fmt: skip
    done, _, all_of_them = kernels.descend(
        q, goal.map, goal.offset, weights, 1e-8, 40, biped().q_index, biped().v_index,
        *np.ascontiguousarray(biped().position_limits.T), robot.links, robot.numbers, robot.work, *room,
    )  # fmt: skip
    return (all_of_them, abs(done - steps) <= 5, 1e-2 * q, room[1][0]), (True, True, 1e-2 * expected, error)


def approach(random: np.random.Generator) -> tuple[Values, Values]:
    """Newton's method finds the way back from a small displacement; `test_multibody` has what makes it give up."""
    robot = Robot(random)
    robot.q[biped().q_index] = 0.9 * biped().bent_knee[biped().q_index]
    robot.drake.set_positions(robot.q)
    target, q = robot.drake.poses().copy(), np.empty(19)
    kernels.move(robot.q, 0.01 * robot.v, robot.links, q)
    rows, offset = np.zeros((21, 39)), np.zeros(18)
    offset[COM], offset[LEFT], offset[RIGHT] = target[:3], target[[18, 22, 26]], target[[30, 34, 38]]
    for place, part in ((COM, range(3)), (LEFT, (18, 22, 26)), (RIGHT, (30, 34, 38))):
        rows[range(place.start, place.stop), part] = -1.0
    for i, turn in enumerate((TORSO_TURN, LEFT_TURN, RIGHT_TURN)):
        R, block = target[3 + 12 * i :][:12].reshape(3, 4)[:, :3], rows[:, 3 + 12 * i : 15 + 12 * i]
        for place in range(9):
            present = np.zeros((3, 3))
            present.flat[place] = 1.0
            skew = 0.5 * (R @ present.T - present @ R.T)
            column = 4 * (place // 3) + place % 3
            block[turn, column] = skew[2, 1], skew[0, 2], skew[1, 0]
            block[18 + i, column] = np.trace(R @ present.T)
    low, high = np.full(12, -9.0), np.full(12, 9.0)
    room = np.empty(39), np.empty(18), np.empty(18), np.empty(19), np.empty((18, 18)), np.empty(18, dtype=np.int64)
    steps = kernels.approach(
        q, rows, offset, 1e-10, 12, 0.5, biped().q_index, low, high, robot.links, robot.numbers, robot.work, *room
    )
    return (0 < steps < 6, q, room[0]), (True, robot.q, target)


def follow(random: np.random.Generator) -> tuple[Values, Values]:
    robot = Robot(random)
    robot.q[biped().q_index] = 0.9 * biped().bent_knee[biped().q_index]
    robot.drake.set_state(robot.q, robot.v)
    kernels.place(robot.q, robot.links, robot.numbers, robot.work)
    jacobian = robot.drake.jacobian()
    rates, accelerations = jacobian @ robot.v, jacobian @ robot.vdot + robot.drake.bias()
    v, vdot, room = np.empty(18), np.empty(18), (np.empty((18, 18)), np.empty(18, dtype=np.int64), np.empty(18))
    ours = np.empty((18, 18))
    done = kernels.follow(
        rates, accelerations, biped().v_index, np.full(12, 10.0), 1e3, robot.links, robot.numbers, robot.work, ours,
        *room, v, vdot,
    )  # fmt: skip
    return (done, ours, v, vdot), (True, jacobian, robot.v, robot.vdot)


def write_shared_wrench(random: np.random.Generator) -> tuple[Values, Values]:
    needed, base, origin, poses = (
        random.normal(size=18),
        random.permutation(18)[:6],
        random.normal(size=3),
        random.normal(size=39),
    )
    jacobian, share, out, joints = random.normal(size=(18, 18)), random.uniform(), np.empty(24), random.permutation(18)
    q, joints, places = random.normal(size=19), joints[:12], random.permutation(19)[:3]
    q[places] = origin
    left, right = poses[15:27].reshape(3, 4)[:, 3], poses[27:39].reshape(3, 4)[:, 3]
    moment, force = needed[base[:3]], needed[base[3:]]
    lever = share * left + (1.0 - share) * right - origin
    wrench = np.concatenate([force, moment - np.cross(lever, force)])
    expected = np.concatenate([share * wrench, (1.0 - share) * wrench])
    torque = needed - expected @ jacobian[LEFT.start :]
    kernels.write_shared_wrench(needed, base, joints, q, places, poses, share, jacobian, out)
    return (out,), (np.concatenate([torque[joints], expected]),)


def move_along(random: np.random.Generator) -> tuple[Values, Values]:
    """The same as one call after another, to the last bit; a seed beyond its limits is refused."""
    body, share, posture = biped(), random.uniform(), random_posture(random)
    space, other = (TreeTaskSpace(body, body.tree) for _ in range(2))
    q, goal = WholeBodyIk(body).solve(posture, body.bent_knee).q, TargetPoses.of(posture)
    space.set_positions(q)
    wanted = np.array([np.zeros(18), space.jacobian() @ (0.1 * random.normal(size=18)), random.normal(size=18)])
    seed = space.moved(q, 0.01 * random.normal(size=18))
    refused = seed.copy()
    refused[body.q_index[3]] = body.position_limits[3, 1] + 0.1
    ours, none = other.move_along(goal, seed, wanted, share), other.move_along(goal, refused, wanted, share)
    found, steps, worst = space.approach(goal, seed)
    followed = space.follow(found, *wanted[1:])
    assert ours is not None and followed is not None
    torque = InverseDynamics(body, space)(found, *followed, share)
    assert none is None
    assert np.array_equal(np.concatenate(ours[:4]), np.concatenate([found, *followed, *torque]))
    return ours[4:], (steps, worst)


CASES = by_name(
    vector, store, store_column, plus, times, cross, turned, turned_back, times_inertia, axis, place, write_poses,
    write_jacobian, accelerate, write_bias, write_forces, write_inertial_forces, write_com_velocity,
    write_poses_and_velocity, move,
    factorize, substitute, within_limits, limit, largest, write_error, write_product, weigh, clip_joints, descend,
    approach, follow, write_shared_wrench, move_along,
)  # fmt: skip


def test_every_kernel_has_a_reference() -> None:
    assert kernels_of(kernels) == set(CASES)


@pytest.mark.parametrize("name", CASES)
def test_kernels_agree_with_numpy_and_drake(name: str) -> None:
    assert_agreement(CASES[name], 1e-9)
