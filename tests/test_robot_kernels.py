"""Every compiled loop of `pdhocbf_drake.robot` beside a few lines of numpy that compute the same."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_cases import Values, assert_agreement, by_name, kernels_of

from pdhocbf_drake.robot import kernels


def left_share_of_zmp(random: np.random.Generator) -> tuple[Values, Values]:
    zmp, left, right = random.normal(size=(3, 2))
    if random.random() < 0.2:
        left = right
    way = left - right
    share = np.clip((zmp - right) @ way / (way @ way), 0.0, 1.0) if way.any() else 0.5
    return (kernels.left_share_of_zmp(zmp, left, right),), (share,)


def left_share(random: np.random.Generator) -> tuple[Values, Values]:
    zmp, left, right = random.normal(size=(3, 3))
    left[2], right[2] = random.choice([0.0, 0.01], size=2)
    on_ground = (kernels.left_share_of_zmp(zmp[:2], left, right), 1.0)[int(right[2] > 0.0)]
    return (kernels.left_share(left, right, zmp[:2]),), (0.0 if left[2] > 0.0 else on_ground,)


def zmp_of_wrenches(random: np.random.Generator) -> tuple[Values, Values]:
    (on_left, on_right), (left, right) = random.normal(size=(2, 6)), random.normal(size=(2, 3))
    moment = on_left[3:] + on_right[3:] + np.cross(left, on_left[:3]) + np.cross(right, on_right[:3])
    force = max(on_left[2] + on_right[2], 1e-6)
    return kernels.zmp_of_wrenches(on_left, left, on_right, right), (-moment[1] / force, moment[0] / force)


def use_of_ground(random: np.random.Generator) -> tuple[Values, Values]:
    (on_left, on_right), (left, right) = random.normal(size=(2, 6)), random.normal(size=(2, 3))
    zmp = np.array([*kernels.zmp_of_wrenches(on_left, left, on_right, right), 0.0])
    force, load = on_left[:3] + on_right[:3], max(on_left[2] + on_right[2], 1e-6)
    moment = on_left[3:] + on_right[3:] + np.cross(left - zmp, on_left[:3]) + np.cross(right - zmp, on_right[:3])
    return kernels.use_of_ground(on_left, left, on_right, right), (np.hypot(*force[:2]) / load, moment[2] / load)


CASES = by_name(left_share, left_share_of_zmp, use_of_ground, zmp_of_wrenches)


def test_every_kernel_has_a_reference() -> None:
    assert kernels_of(kernels) == set(CASES)


@pytest.mark.parametrize("name", CASES)
def test_kernels_agree_with_numpy(name: str) -> None:
    assert_agreement(CASES[name], 1e-9)
