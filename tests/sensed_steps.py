"""Ideal sensors of a robot that steps in exact kinematics, without a simulator, and noise for them."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from biped_cases import biped, ik
from scipy.spatial.transform import Rotation

from pdhocbf_drake.estimation.config import SensorsConfig
from pdhocbf_drake.estimation.sample import Sample
from pdhocbf_drake.robot import Posture, sole_pose

TICK, STEP, STRIDE, HALF = 0.01, 40, 0.1, 0.08
PAUSE = 4  # ticks with both feet at rest at the start and end of a step
GRAVITY = np.array([0.0, 0.0, -9.81])


class Motion(NamedTuple):
    """Base orientation (T, 3, 3), velocity and place (T, 3), joints (T, 12), soles (T, 2, 3), load of each (T, 2)."""

    turn: np.ndarray
    velocity: np.ndarray
    place: np.ndarray
    joints: np.ndarray
    soles: np.ndarray
    loads: np.ndarray


@cache
def stepping(ticks: int = 320) -> Motion:
    """Two standing steps, then steps of 0.1 m; the CoM sways over the standing foot."""
    robot, q = biped(), biped().bent_knee
    feet, found, soles, loads = np.array([[0.0, HALF], [0.0, -HALF]]), [], [], []
    weight = robot.weight
    for k in range(ticks):
        step, phase = divmod(k, STEP)
        s, lift = 0.0, np.zeros(2)
        here, load = feet.copy(), np.full(2, 0.5 * weight)
        if step >= 2:
            swing = step % 2
            share = min(max(phase - PAUSE, 0) / (STEP - 2 * PAUSE), 1.0)
            s = (1.0 - np.cos(np.pi * share)) / 2.0
            ahead = STRIDE * (0.5 if step == 2 else 1.0)
            here[swing, 0] += ahead * s
            lift[swing] = 0.04 * np.sin(np.pi * share) ** 2
            load[swing], load[1 - swing] = (0.0, weight) if 0.0 < share < 1.0 else (0.5 * weight, 0.5 * weight)
            if phase == STEP - 1:
                feet[swing, 0] += ahead
        sway = 0.02 * np.sin(np.pi * k / STEP) ** 4 * (1.0 if step % 2 else -1.0)
        com = np.array([here[:, 0].mean(), sway, 0.57])
        left, right = (sole_pose(*here[i], lift[i]) for i in (0, 1))
        q = ik().solve(Posture(com, left, right), q).q
        found.append(q)
        soles.append(np.column_stack([here, lift]))
        loads.append(load)
    table = np.array(found)
    quaternion, place = table[:, robot.base_q_index[:4]], table[:, robot.base_q_index[4:]]
    turn = Rotation.from_quat(quaternion[:, [1, 2, 3, 0]]).as_matrix()
    velocity = np.gradient(place, TICK, axis=0)
    return Motion(turn, velocity, place, table[:, robot.q_index], np.array(soles), np.array(loads))


def samples(motion: Motion, config: SensorsConfig, seed: int | None) -> list[Sample]:
    """The sensors' samples, with noise, biases and offsets of the config; without a seed next to none."""
    count, turn, velocity = len(motion.place), motion.turn, motion.velocity
    imu, joints = np.zeros((count, 9)), motion.joints.copy()
    rotations = Rotation.from_matrix(turn)
    imu[1:, :3] = (rotations[:-1].inv() * rotations[1:]).as_rotvec() / TICK
    imu[1:, 3:6] = rotations[:-1].inv().apply(np.diff(velocity, axis=0) / TICK - GRAVITY)
    rates = np.gradient(joints, TICK, axis=0)
    forces = np.zeros((count, 12))
    forces[:, [5, 11]] = motion.loads
    drawn, sensor = np.random.default_rng(seed), config.imu
    imu[:, :6] += 1e-9 * drawn.normal(size=(count, 6))  # no real sensor says the very same twice
    forces += 1e-6 * drawn.normal(size=forces.shape)
    if seed is not None:
        drawn = np.random.default_rng(seed)
        bias = np.repeat([sensor.gyro_bias, sensor.accelerometer_bias], 3) * drawn.normal(size=6)
        noise = np.repeat([sensor.gyro_noise, sensor.accelerometer_noise], 3) / np.sqrt(TICK)
        imu[:, :6] += bias + noise * drawn.normal(size=(count, 6))
        joints += config.encoders.left_offset * drawn.normal(size=12)
        joints += 3e-5 * drawn.normal(size=joints.shape)
        forces += 0.1 * drawn.normal(size=forces.shape)
    imu[:, 6:] = imu[:, :3]
    encoders = np.hstack([joints, rates])
    return [Sample(*row) for row in zip(imu, encoders, forces, strict=True)]
