"""Every compiled loop of `pdhocbf_drake.robot` beside a few lines of numpy that compute the same."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

from pdhocbf_drake.robot import kernels
from pdhocbf_drake.robot.posture import COM, LEFT, LEFT_TURN, RIGHT, RIGHT_TURN, TORSO_TURN

Values = tuple[np.ndarray | float, ...]
Case = Callable[[np.random.Generator], tuple[Values, Values]]
"""Runs a kernel and its reference on random arrays: what both return and write."""

QUATERNION = np.array([2, 0, 3, 1])


def with_nan(random: np.random.Generator, values: np.ndarray) -> np.ndarray:
    """The values, with NaN among them in a third of the cases."""
    if random.random() < 1 / 3:
        values[random.integers(len(values))] = np.nan
    return values


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
    n = 18
    matrix, right, pivots, x = (
        random.normal(size=(n, n)),
        random.normal(size=n),
        np.empty(n, dtype=np.int64),
        np.empty(n),
    )
    factors = matrix.copy()
    kernels.factorize(factors, pivots)
    kernels.substitute(factors, pivots, right, x)
    return (matrix @ x,), (right,)


def move_along(random: np.random.Generator) -> tuple[Values, Values]:
    q, step, out = random.normal(size=7), random.normal(size=7), np.empty(7)
    kernels.move_along(q, step, QUATERNION, out)
    expected = q + step
    expected[QUATERNION] /= np.linalg.norm(expected[QUATERNION])
    return (out,), (expected,)


def within_limits(random: np.random.Generator) -> tuple[Values, Values]:
    joints, lower, upper = np.array([4, 6]), np.array([-1.0, -2.0]), np.array([1.0, 2.0])
    q = random.uniform(-1.3, 1.3, 7)
    if random.random() < 0.7:
        q[QUATERNION] /= np.linalg.norm(q[QUATERNION])
    q = with_nan(random, q)
    inside = ((q[joints] >= lower) & (q[joints] <= upper)).all() and abs(np.linalg.norm(q[QUATERNION]) - 1.0) < 1e-12
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


def write_poses(random: np.random.Generator) -> tuple[Values, Values]:
    com, (torso, left, right), out = random.normal(size=3), random.normal(size=(3, 3, 4)), np.empty(39)
    kernels.write_poses(com, torso, left, right, out)
    return (out,), (np.concatenate([com, torso.ravel(), left.ravel(), right.ravel()]),)


def write_error(random: np.random.Generator) -> tuple[Values, Values]:
    rows, offset, poses, out = (
        random.normal(size=(21, 39)),
        random.normal(size=18),
        random.normal(size=39),
        np.empty(18),
    )
    rows[18:] += random.uniform(0.0, 1.0) * np.sign(poses)
    small = kernels.write_error(rows, offset, poses, out)
    return (out, small), (offset + rows[:18] @ poses, (rows[18:] @ poses >= 2.99).all())


def write_jacobian(random: np.random.Generator) -> tuple[Values, Values]:
    com, (torso, left, right) = random.normal(size=(3, 18)), random.normal(size=(3, 6, 18))
    out, again, expected = np.empty((18, 18)), np.empty((18, 18)), np.empty((18, 18))
    kernels.write_jacobian(com, torso, left, right, out, again)
    expected[COM], expected[TORSO_TURN] = com, torso[:3]
    expected[LEFT_TURN], expected[LEFT] = np.split(left, 2)
    expected[RIGHT_TURN], expected[RIGHT] = np.split(right, 2)
    return (out, again), (expected, expected)


def write_bias(random: np.random.Generator) -> tuple[Values, Values]:
    force, base, (torso, left, right) = random.normal(size=18), random.permutation(18)[:6], random.normal(size=(3, 6))
    out, expected = np.empty(18), np.empty(18)
    kernels.write_bias(force, base, 29.0, torso, left, right, out)
    expected[COM], expected[TORSO_TURN] = force[base[3:]] / 29.0, torso[:3]
    expected[LEFT_TURN], expected[LEFT] = np.split(left, 2)
    expected[RIGHT_TURN], expected[RIGHT] = np.split(right, 2)
    return (out,), (expected,)


def write_shared_wrench(random: np.random.Generator) -> tuple[Values, Values]:
    needed, base, origin, poses = (
        random.normal(size=18),
        random.permutation(18)[:6],
        random.normal(size=3),
        random.normal(size=39),
    )
    jacobian, share, both = random.normal(size=(18, 18)), random.uniform(), np.empty(12)
    left, right = poses[15:27].reshape(3, 4)[:, 3], poses[27:39].reshape(3, 4)[:, 3]
    moment, force = needed[base[:3]], needed[base[3:]]
    lever = share * left + (1.0 - share) * right - origin
    wrench = np.concatenate([force, moment - np.cross(lever, force)])
    expected = np.concatenate([share * wrench, (1.0 - share) * wrench])
    torque = needed - expected @ jacobian[LEFT.start :]
    kernels.write_shared_wrench(needed, base, origin, poses, share, jacobian, both)
    return (needed, both), (torque, expected)


def left_share_of_zmp(random: np.random.Generator) -> tuple[Values, Values]:
    zmp, left, right = random.normal(size=(3, 2))
    if random.random() < 0.2:
        left = right
    way = left - right
    share = np.clip((zmp - right) @ way / (way @ way), 0.0, 1.0) if way.any() else 0.5
    return (kernels.left_share_of_zmp(zmp, left, right),), (share,)


def zmp_of_wrenches(random: np.random.Generator) -> tuple[Values, Values]:
    (on_left, on_right), (left, right) = random.normal(size=(2, 6)), random.normal(size=(2, 3))
    moment = on_left[3:] + on_right[3:] + np.cross(left, on_left[:3]) + np.cross(right, on_right[:3])
    force = max(on_left[2] + on_right[2], 1e-6)
    return kernels.zmp_of_wrenches(on_left, left, on_right, right), (-moment[1] / force, moment[0] / force)


CASES: dict[str, Case] = {
    case.__name__: case
    for case in (
        factorize, substitute, move_along, within_limits, limit, largest, write_poses, write_error, write_jacobian,
        write_bias, write_shared_wrench, left_share_of_zmp, zmp_of_wrenches,
    )
}  # fmt: skip


def test_every_kernel_has_a_reference() -> None:
    assert {name for name, value in vars(kernels).items() if isinstance(value, CPUDispatcher)} == set(CASES)


@pytest.mark.parametrize("name", CASES)
def test_kernels_agree_with_numpy(name: str) -> None:
    for seed in range(30):
        found, expected = CASES[name](np.random.default_rng(seed))
        for ours, theirs in zip(found, expected, strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9, err_msg=f"seed {seed}")
