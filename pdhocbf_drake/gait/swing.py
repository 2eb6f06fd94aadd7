"""The swing foot: minimum jerk along the ground, a smooth bump above it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class SwingPoint(NamedTuple):
    """A point of the swing: position [m], velocity [m/s], acceleration [m/s²], each of shape (3,)."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def swing_point(start: np.ndarray, end: np.ndarray, height: float, duration: float, time: float) -> SwingPoint:
    """The swing sole at `time` of `duration` seconds, from `start` to `end`, shape (2,) or (3,) [m].

    With s = time/duration ∈ [0, 1]: x and y follow 10s³ − 15s⁴ + 6s⁵, z follows 64 height s³(1 − s)³, so that
    velocity and acceleration vanish at both ends and z is `height` at s = 1/2. Outside [0, 1] the foot rests.
    """
    s = min(max(time / duration, 0.0), 1.0)
    rate = 1.0 / duration
    blend = s**3 * (10.0 + s * (-15.0 + 6.0 * s))
    blend_v = 30.0 * s**2 * (1.0 - s) ** 2 * rate
    blend_a = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) * rate**2
    r = s * (1.0 - s)
    r_v = (1.0 - 2.0 * s) * rate
    lift = 64.0 * height * r**3
    lift_v = 192.0 * height * r**2 * r_v
    lift_a = 192.0 * height * (2.0 * r * r_v**2 - 2.0 * r**2 * rate**2)
    move = np.zeros(3)
    move[: len(end)] = np.asarray(end) - np.asarray(start)
    base = np.zeros(3)
    base[: len(start)] = start
    up = np.array([0.0, 0.0, 1.0])
    return SwingPoint(base + blend * move + lift * up, blend_v * move + lift_v * up, blend_a * move + lift_a * up)
