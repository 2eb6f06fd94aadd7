"""A calibration from standing postures finds the encoders' zero positions as well as it says."""

from __future__ import annotations

import numpy as np
from biped_cases import biped, ik
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RotationMatrix

from pdhocbf_drake.estimation.calibration import calibrated_offsets
from pdhocbf_drake.estimation.legs import Legs
from pdhocbf_drake.robot import Posture, sole_pose

OFFSET, BIAS, NOISE = 0.003, 0.1, 2e-3


def postures() -> list[np.ndarray]:
    """q of squats, shifts and bows on the same footholds."""
    found, q = [], biped().bent_knee
    ways = [(x, y, z, roll, pitch, yaw) for z in (0.50, 0.54, 0.57) for x, y, roll, pitch, yaw in (
        (0.0, 0.0, 0.0, 0.0, 0.0), (0.03, 0.0, 0.0, 0.3, 0.0), (-0.03, 0.0, 0.0, -0.2, 0.0),
        (0.0, 0.04, 0.15, 0.0, 0.3), (0.0, -0.04, -0.15, 0.0, -0.3), (0.0, 0.0, 0.0, 0.2, 0.35),
    )]  # fmt: skip
    for x, y, z, *rpy in ways:
        target = Posture(np.array([x, y, z]), sole_pose(0.0, 0.08), sole_pose(0.0, -0.08), np.array(rpy))
        result = ik().solve(target, q)
        assert result.ok
        found.append(result.q)
    return found


def measured(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Offsets, angles and forces of each posture with noise."""
    random, robot = np.random.default_rng(seed), biped()
    offsets, bias = OFFSET * random.normal(size=12), BIAS * random.normal(size=3)
    angles, forces = [], []
    for q in postures():
        w = q[robot.base_q_index[:4]]
        turn = RotationMatrix(Quaternion(w / np.linalg.norm(w))).matrix()
        forces.append(turn.T @ [0.0, 0.0, 9.81] + bias + NOISE * random.normal(size=3))
        angles.append(q[robot.q_index] + offsets)
    return offsets, np.array(angles), np.array(forces)


def test_it_halves_the_error_and_says_how_much_is_left():
    legs, before, after, squares = Legs(biped()), [], [], []
    for seed in range(5):
        offsets, angles, forces = measured(seed)
        found, covariance = calibrated_offsets(legs, angles, forces, OFFSET, BIAS)
        left = found - offsets
        before.append(np.mean(offsets**2))
        after.append(np.mean(left**2))
        squares.append(left @ np.linalg.solve(covariance, left))
    assert np.sqrt(np.mean(after)) < 0.5 * np.sqrt(np.mean(before))
    assert np.mean(squares) < 1.5 * 12


def test_without_offsets_it_finds_none():
    _, _, forces = measured(0)
    exact = np.array([q[biped().q_index] for q in postures()])
    found, _ = calibrated_offsets(Legs(biped()), exact, forces, OFFSET, BIAS)
    assert np.abs(found).max() < 0.5 * OFFSET
