"""The torso's yaw, which gives way before the soles slip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot.grip import Grip

RETURN = 4.0  # [rad/s]: with which the torso comes back, critically damped
_REST = 1e-7  # [rad, rad/s]: below it, it is back
_LARGEST = 0.5  # [rad]: beyond it the torso gives way no more
FASTEST = (
    40.0  # [rad/s²], twice what a walk at a friction of 0.1 needs; a plan that hardly loads the soles asks for any
)


class TorsoYaw(NamedTuple):
    """Deviation ψ of the torso's yaw from its reference, and its rate [rad, rad/s]."""

    angle: float = 0.0
    rate: float = 0.0

    @property
    def returning(self) -> float:
        """Acceleration with which it comes back, −2ωψ̇ − ω²ψ [rad/s²]."""
        return -RETURN * (2.0 * self.rate + RETURN * self.angle)

    def yielding(self, grip: Grip, acceleration: float, used: float, moment: float) -> float:
        """The acceleration nearest to a planned one at which the soles keep their grip, at most `FASTEST` [rad/s²].

        Args:
            grip: of the soles.
            acceleration: α, planned.
            used, moment: |F_xy|/F_z and M_z/F_z of the motion with α [1, m].
        """
        most = grip.largest_moment(used)
        if -most <= moment <= most or abs(self.angle) > _LARGEST:
            return acceleration
        keeping = acceleration + (max(-most, min(moment, most)) - moment) / grip.lever
        return max(-FASTEST, min(keeping, FASTEST))

    def after(self, acceleration: float, tick: float) -> TorsoYaw:
        """A tick later [s]; at rest where it is back."""
        angle = self.angle + tick * (self.rate + 0.5 * tick * acceleration)
        rate = self.rate + tick * acceleration
        return TorsoYaw() if max(abs(angle), abs(rate)) < _REST else TorsoYaw(angle, rate)


def add_to(wanted: np.ndarray, row: int, yaw: TorsoYaw, acceleration: float) -> None:
    """Adds rate and acceleration of the deviation to the task's motion (3, 18), in the row of the torso's yaw."""
    wanted[1, row] += yaw.rate
    wanted[2, row] += acceleration
