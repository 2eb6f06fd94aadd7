"""What the sensors say that can't be, and what stands in for it."""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.estimation.config import SensorsConfig
from pdhocbf_drake.estimation.memory import Memory
from pdhocbf_drake.estimation.sample import Notice, Sample

_REPEATS = 2  # ticks in a row with the very same numbers, of a sensor with noise, are too many
_STUCK = 0.003  # [rad] that a joint is to move, besides some steps of its encoder, while the encoder rests
_STEPS = 3.0
_FAR = 0.3  # [rad] between an encoder and its joint's target
_COUNT = 12
_GYROSCOPE, _ACCELEROMETER = slice(0, 3), slice(3, 6)


def notice_imu(memory: Memory, sample: Sample, config: SensorsConfig) -> Notice:
    """Whether gyroscope and accelerometer can be right; moves `imu` and `repeats` on."""
    notice, now, last = Notice.NONE, sample.imu.tolist(), memory.imu.tolist()
    noisy = config.imu.gyro_noise > 0.0, config.imu.accelerometer_noise > 0.0
    for place, (part, flag) in enumerate(((_GYROSCOPE, Notice.GYROSCOPE), (_ACCELEROMETER, Notice.ACCELEROMETER))):
        memory.repeats[place] = memory.repeats[place] + 1.0 if now[part] == last[part] and noisy[place] else 0.0
        silent = noisy[place] and not any(now[part])  # noise is never 0 on all axes
        if silent or not all(map(math.isfinite, now[part])) or memory.repeats[place] >= _REPEATS:
            notice |= flag
    if not all(map(math.isfinite, now[6:])):
        notice |= Notice.GYROSCOPE
    memory.imu[:] = sample.imu
    return notice


def trusted_encoders(memory: Memory, sample: Sample, config: SensorsConfig) -> tuple[np.ndarray, Notice]:
    """Angles and rates (24,) to go by, and whether one of the encoders can't be right; moves `joints` and `gap` on.

    An encoder that fails is replaced by its joint's target and the distance that the two had when it last changed.
    """
    angles, rates, targets = sample.encoders[:_COUNT], sample.encoders[_COUNT:], sample.targets
    bad, found = ~(np.isfinite(angles) & np.isfinite(rates)), sample.encoders.copy()
    if targets is None:
        found[:_COUNT][bad], found[_COUNT:][bad] = memory.joints[bad], 0.0
    else:
        aims, changed = targets[:_COUNT], angles != memory.joints
        memory.moved[changed] = aims[changed]
        most = _STUCK + _STEPS * 2.0 * math.pi / 2.0**config.encoders.bits
        bad |= (np.abs(aims - memory.moved) > most) | ~(np.abs(angles - aims) < _FAR)
        memory.gap[:] = np.where(bad, memory.gap, angles - aims)
        if bad.any():
            found[:_COUNT][bad], found[_COUNT:][bad] = (aims + memory.gap)[bad], targets[_COUNT:][bad]
    memory.joints[:] = np.where(bad & ~np.isfinite(angles), memory.joints, angles)
    return found, Notice.ENCODER if bad.any() else Notice.NONE


def trusted_forces(memory: Memory, sample: Sample, config: SensorsConfig, weight: float) -> np.ndarray:
    """Whether each foot's force can be right (2,); moves `force_torque` and `repeats` on.

    Where neither foot carries load, at least one of them is wrong.
    """
    trusted, noisy = np.ones(2, dtype=bool), config.force_torque.force_noise > 0.0
    for side in (0, 1):
        part = slice(6 * side, 6 * side + 6)
        wrench = sample.force_torque[part].tolist()
        repeats = wrench == memory.force_torque[part].tolist()
        memory.repeats[2 + side] = memory.repeats[2 + side] + 1.0 if repeats and noisy else 0.0
        finite = all(map(math.isfinite, wrench))
        trusted[side] = finite and memory.repeats[2 + side] < _REPEATS
        memory.force_torque[part] = wrench if finite else 0.0
    if memory.force_torque[5] + memory.force_torque[11] < config.estimator.load_off * weight:
        trusted[:] = False
    return trusted
