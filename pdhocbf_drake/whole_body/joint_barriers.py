"""Joint angles and speeds as discrete-time high-order barriers on joint accelerations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.barriers.barrier import AffineBarrier
from pdhocbf_drake.barriers.bounds import constant
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem
from pdhocbf_drake.barriers.rows import affine_rows
from pdhocbf_drake.whole_body.kernels import write_interval


class JointBarriers(NamedTuple):
    """For each joint with angle q, speed v and acceleration a, in a tick δ

        q(k+1) = q(k) + δ v(k),    v(k+1) = v(k) + δ a(k),

    ψ_2 of h = ±(q_limit − q), of relative degree 2, and ψ_1 of h = ±(v_limit − v) with γ = 1, are lower or upper
    bounds of a(k), affine in q and v. With γ_1 + γ_2 ≤ 1 the bounds leave an acceleration wherever ψ_0, ψ_1 ≥ 0.

    Attributes:
        coefficients: of q, v and q_limit in the bound of an angle's barrier, of v and v_limit in that of a speed's.
        lower, upper, speed: limits of the joints, shape (n,) each [rad, rad/s].
    """

    coefficients: tuple[float, float, float, float, float]
    lower: np.ndarray
    upper: np.ndarray
    speed: np.ndarray

    @classmethod
    def of(
        cls, lower: np.ndarray, upper: np.ndarray, speed: np.ndarray, gammas: tuple[float, float], tick: float
    ) -> JointBarriers:
        """The barriers of joints with these limits, (n,) each, and class-K slopes γ_1, γ_2; tick: δ [s]."""
        joint = joint_system(tick)
        angle = affine_rows(angle_barrier(0.0, 1, gammas), joint, 0, 2)
        rate = affine_rows(AffineBarrier("speed", [0.0, 1.0], constant(0.0), 1, [1.0]), joint, 0, 1)
        on_angle, on_speed = (-angle.state[0] / angle.inputs[0, 0]).tolist()
        on_limit, on_most = (float(-row.bounds[0].sum() / row.inputs[0, 0]) for row in (angle, rate))
        coasting = float(-rate.state[0, 1] / rate.inputs[0, 0])
        return cls((on_angle, on_speed, on_limit, coasting, on_most), lower, upper, speed)

    def interval(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest acceleration (n,) at angles q and speeds v, (n,) each [rad/s²].

        Where an angle and a speed leave none, outside of ψ_0, ψ_1 ≥ 0, the speed gives way.
        """
        low, high = np.empty(len(q)), np.empty(len(q))
        write_interval(q, v, self.coefficients, self.lower, self.upper, self.speed, low, high)
        return low, high


def joint_system(tick: float) -> PeriodicAffineSystem:
    """Angle and speed of a joint under its acceleration, in ticks δ [s]."""
    return PeriodicAffineSystem([[[1.0, tick], [0.0, 1.0]]], [[[0.0], [tick]]])


def angle_barrier(limit: float, sign: int, gammas: tuple[float, float]) -> AffineBarrier:
    """h = sign · (limit − q) [rad]."""
    return AffineBarrier("angle", [1.0, 0.0], constant(limit), sign, gammas, "rad")
