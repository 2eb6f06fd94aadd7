"""How much of the joints' limits a gait uses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.robot import ROLES, Biped
from pdhocbf_drake.studies.shared.gait_measures import GaitMeasures


class JointLimits(NamedTuple):
    """Limits of each role, the smaller of both legs: torque [N m] and speed [rad/s]."""

    effort: dict[str, float]
    speed: dict[str, float]

    @classmethod
    def of(cls, biped: Biped) -> JointLimits:
        """Those of a robot."""
        effort, speed = (v.reshape(2, -1).min(axis=0) for v in (biped.effort_limits, biped.velocity_limits))
        return cls(*(dict(zip(ROLES, values.tolist(), strict=True)) for values in (effort, speed)))

    def torque_shares(self, gait: GaitMeasures) -> np.ndarray:
        """Torque of each role over its limit (6,)."""
        assert gait.torque is not None
        return np.array([gait.torque[role] / self.effort[role] for role in ROLES])

    def speed_shares(self, gait: GaitMeasures) -> np.ndarray:
        """Speed of each role's joints over its limit (6,)."""
        assert gait.joint_speed is not None
        return np.array([gait.joint_speed[role] / self.speed[role] for role in ROLES])

    def largest_share(self, gait: GaitMeasures) -> float:
        """The largest of both."""
        return float(max(self.torque_shares(gait).max(), self.speed_shares(gait).max()))

    def asked_most(self, gait: GaitMeasures) -> str:
        """The joint of the largest share, in words."""
        by_torque, by_speed = self.torque_shares(gait), self.speed_shares(gait)
        shares, what = (by_torque, "torque") if by_torque.max() >= by_speed.max() else (by_speed, "speed")
        return f"{ROLES[int(shares.argmax())]} uses {100.0 * shares.max():.0f} % of its {what}"
