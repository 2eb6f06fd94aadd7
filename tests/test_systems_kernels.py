"""Every compiled loop of `pdhocbf_drake.systems` beside a few lines of numpy that compute the same."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_cases import Values, assert_agreement, by_name, kernels_of
from pydrake.math import RollPitchYaw

from pdhocbf_drake.robot import posture
from pdhocbf_drake.systems import kernels
from pdhocbf_drake.systems.signals import places, size


def write_h(random: np.random.Generator) -> tuple[Values, Values]:
    signs, axes, normals = random.choice([-1.0, 1.0], 3), random.integers(0, 2, 3), random.normal(size=(3, 3))
    bounds, lip = random.normal(size=(3, 5)), random.normal(size=6)
    if random.random() < 0.3:
        lip[3 * random.integers(2) :][:3] = np.nan
    out, stances = np.empty(3), random.normal(size=3)
    kernels.write_h(signs, axes, normals, stances, lip, bounds.ravel(), out)
    seen = lip.reshape(2, 3)[axes] - np.multiply.outer(stances, [1.0, 0.0, 1.0])
    return (out,), (signs * (bounds[:, 0] - (normals * seen).sum(axis=1)),)


def write_estimate(random: np.random.Generator) -> tuple[Values, Values]:
    com, velocity, q, force = (random.normal(size=n) for n in (3, 3, 19, 18))
    angles, origins, out = random.uniform(-1.5, 1.5, (3, 3)), random.normal(size=(3, 3)), np.empty(21)
    rotations = [RollPitchYaw(rpy).ToRotationMatrix().matrix() for rpy in angles]
    frames = [np.column_stack([R, p]).ravel() for R, p in zip(rotations, origins, strict=True)]
    origin, base = random.permutation(19)[:3], random.permutation(18)[:6]
    held = random.choice([kernels.NO_ZMP, np.nan, 0.3]) + np.array([0.0, 0.1])
    force[base[5]] = random.choice([-5.0, 0.5, 300.0])
    ground = random.choice([0.0, 0.3])
    kernels.write_estimate(np.concatenate([com, *frames]), velocity, q, origin, force, base, ground, 1.0, held, out)
    zmp = com[:2] if not (held < kernels.NO_ZMP).all() else held
    if force[base[5]] > 1.0:  # the moment about the ZMP (x, y, ground) has no horizontal part
        moment = force[base[:3]] + np.cross(q[origin] - [0.0, 0.0, ground], force[base[3:]])
        zmp = np.array([-moment[1], moment[0]]) / force[base[5]]
    lip = [com[0], velocity[0], zmp[0], com[1], velocity[1], zmp[1]]
    feet = np.column_stack([origins, angles])[1:].ravel()
    return (out,), ([*lip, com[2], velocity[2], *feet, force[base[5]]],)


def write_step(random: np.random.Generator) -> tuple[Values, Values]:
    q, (v, vdot, before), tick, step = random.normal(size=7), random.normal(size=(3, 6)), 0.1, np.empty(6)
    kernels.write_step(np.concatenate([q, v, vdot, before]), tick, step)
    return (step,), (tick * v + tick**2 / 2 * vdot + tick**3 / 6 * (vdot - before) / tick,)


def write_motion(random: np.random.Generator) -> tuple[Values, Values]:
    (q, last_q), (v, vdot, last_v, last_vdot, before) = random.normal(size=(2, 9)), random.normal(size=(5, 8))
    joints, tau, zmp, out = random.permutation(9)[:4], random.normal(size=4), (0.1, -0.2), np.empty(50)
    met = bool(random.random() < 0.7)
    last = np.concatenate([last_q, last_v, last_vdot, before])
    kernels.write_motion(q, v, vdot, last, joints, 0.01, tau, zmp, (met, 0.3, 5), out)
    targets = np.concatenate([q[joints], (q - last_q)[joints] / 0.01])
    following = np.concatenate([q, met * v, met * vdot, met * last_vdot])
    return (out,), (np.concatenate([targets, tau, zmp, [met, 0.3, 5], following]),)


def write_wanted(random: np.random.Generator) -> tuple[Values, Values]:
    com, height, feet = random.normal(size=6), random.normal(size=3), random.normal(size=18)
    wanted = random.normal(size=(3, 18))
    expected = wanted.copy()
    kernels.write_wanted(com, height, feet, wanted)
    expected[:, posture.COM] = np.column_stack([com[:3], com[3:], height])
    expected[:, posture.LEFT], expected[:, posture.RIGHT] = feet.reshape(2, 3, 3)
    return (wanted,), (expected,)


def write_table_offset(random: np.random.Generator) -> tuple[Values, Values]:
    period, horizon = 6, 14
    phase, side, table = int(random.integers(period)), random.choice([-1.0, 0.0, 1.0], horizon), random.normal(size=12)
    out = np.empty((2, horizon))
    kernels.write_table_offset(phase, side, table, out)
    x, y = np.take(table.reshape(2, period), phase + 1 + np.arange(horizon), axis=1, mode="wrap")
    return (out,), (np.array([x * abs(side), y * side]),)


def update_table(random: np.random.Generator) -> tuple[Values, Values]:
    period, support, lever = 6, float(random.choice([-1.0, 1.0])), (0.002, -0.003)
    phase, table, feet = int(random.integers(period)), 0.05 * random.normal(size=2 * period), random.normal(size=18)
    zmp, planned = 0.1 * random.normal(size=2), 0.1 * random.normal(size=4)
    if random.random() < 0.3:
        zmp[random.integers(2)] = random.choice([np.nan, np.inf])
    expected = table.copy()
    swing = 1 if support > 0 else 0
    difference = zmp - planned[[0, 2]] - lever * feet.reshape(2, 3, 3)[swing, 2, :2]
    entries = [phase, period + phase]
    if np.isfinite(difference).all():
        expected[entries] = (expected[entries] + np.clip(difference * [1.0, support], -0.08, 0.08)) / 2
    kernels.update_table(phase, support, zmp, planned, feet, lever, 0.08, table)
    return (table,), (expected,)


def learn_bias(random: np.random.Generator) -> tuple[Values, Values]:
    memory, joints, leg = random.normal(size=13), np.array([1, 2, 3]), int(random.integers(-1, 2))
    applied, feedforward, most = random.normal(size=12), random.normal(size=12), float(random.choice([0.5, 50.0]))
    if random.random() < 0.3:
        applied[random.integers(12)] = random.choice([np.nan, np.inf])
    expected = memory.copy()
    expected[12] += np.clip(0.7 - memory[12], -0.1, 0.1)
    if leg >= 0:
        place = 6 * leg + joints
        error = (applied - feedforward)[place] - memory[place]
        if np.isfinite(error).all():
            expected[place] += 0.02 * error * min(1.0, most / np.linalg.norm(error))
    kernels.learn_bias(memory, joints, leg, applied, feedforward, 0.02, most, (0.7, 0.1))
    return (memory,), (expected,)


def write_sent_torque(random: np.random.Generator) -> tuple[Values, Values]:
    memory, feedforward, out = random.normal(size=13), random.normal(size=12), np.empty(24)
    limits = random.uniform(0.1, 2.0, 12)
    lengths, shares = np.linalg.norm(memory[:12].reshape(2, 6), axis=1), np.array([memory[12], 1.0 - memory[12]])
    bias = ((shares * np.clip(lengths / 2.0 - 1.0, 0.0, 1.0))[:, None] * memory[:12].reshape(2, 6)).ravel()
    most = np.maximum(limits, abs(feedforward))
    bias = np.clip(bias, -most - feedforward, most - feedforward)
    kernels.write_sent_torque(memory, feedforward, 2.0, limits, out)
    return (out,), (np.concatenate([bias, feedforward + bias]),)


CASES = by_name(
    write_h, write_estimate, write_step, write_motion, write_wanted, write_table_offset, update_table, learn_bias,
    write_sent_torque,
)  # fmt: skip


def test_every_kernel_has_a_reference() -> None:
    assert kernels_of(kernels) == set(CASES)


@pytest.mark.parametrize("name", CASES)
def test_kernels_agree_with_numpy(name: str) -> None:
    assert_agreement(CASES[name], 1e-11)


def test_the_kernels_offsets_are_those_of_the_signals_and_of_the_task_coordinates() -> None:
    assert places("foot_reference", "left_ax", "right_x") == [kernels.ACCELERATION, kernels.FOOT]
    assert places("foot_reference", "left_vx") == [kernels.AXES]
    assert size("lip_state") == kernels.COM_Z
    assert size("lip_state") + size("com_z") == kernels.FEET
    assert kernels.FEET + size("foot_state") == kernels.LOAD
    assert (posture.COM.start, posture.LEFT.start, posture.RIGHT.start) == (kernels.COM, kernels.LEFT, kernels.RIGHT)
