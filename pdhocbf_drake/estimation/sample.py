"""What the sensors say at a tick, and what is estimated from it."""

from __future__ import annotations

from enum import IntFlag
from typing import NamedTuple

import numpy as np


class Sample(NamedTuple):
    """What the sensors say at a tick, and what the robot was asked to do.

    Attributes:
        imu: mean rate [rad/s] and specific force [m/s²] over the last tick in the base's axes at its start, then the
            rate at its end [rad/s], (9,).
        encoders: angles, then rates of the joints (24,) [rad, rad/s].
        force_torque: moment [N m] and force [N] of the ground about each sole's centre, in its axes, left, then
            right (12,).
        targets: the joints' targets, then their rates (24,) [rad, rad/s]; what stands in for an encoder that fails.
            None without.
        support: the foot that is to stand, +1 left, −1 right, 0 both; what stands in for a force sensor that fails.
            None without.
    """

    imu: np.ndarray
    encoders: np.ndarray
    force_torque: np.ndarray
    targets: np.ndarray | None = None
    support: float | None = None


class Notice(IntFlag):
    """What the estimator finds wrong with its sensors; several may be at once."""

    NONE = 0
    GYROSCOPE = 1
    """Not finite, or the same for several ticks: the standing leg's joints stand in for it."""
    ACCELEROMETER = 2
    """Likewise."""
    ENCODER = 4
    """Not finite, or at rest while its joint is to move: the joint's target stands in for it."""
    FORCE_TORQUE = 8
    """Not finite, the same for several ticks, or no load on either foot: the foot that is to stand counts as loaded."""
    FLICKER = 16
    """The load of a foot comes and goes: likewise."""
    SLIP = 32
    """A loaded foot turns about the vertical, or is not where it was put: it is not used, and put down anew."""
    IN_THE_AIR = 64
    """No foot stands: only the IMU leads the estimate on."""


class Estimate(NamedTuple):
    """What is handed on, counted from the place where the stance foot was when it took the load.

    Attributes:
        lip_state: c, v and ZMP of x, then of y (6,) [m, m/s, m].
        com_z: height of the CoM over the ground and its rate (2,) [m, m/s].
        foot_state: each sole's centre and roll, pitch, yaw, left, then right (12,) [m, rad].
        deviation: standard deviation of CoM from the stance foot and CoM velocity, x, y and z each (6,) [m, m/s].
        status: `Notice`, loaded and standing left and right, squared innovations, and their number, foot held (8,).
    """

    lip_state: np.ndarray
    com_z: np.ndarray
    foot_state: np.ndarray
    deviation: np.ndarray
    status: np.ndarray
