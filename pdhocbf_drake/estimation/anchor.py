"""The simple estimator: the standing foot is flat, at rest, and where it landed."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.estimation import kernels
from pdhocbf_drake.estimation.base_filter import BaseFilter
from pdhocbf_drake.estimation.kernels import ACCELEROMETER_BIAS, GYRO_BIAS, SOLES, P, R, V
from pdhocbf_drake.estimation.memory import Memory
from pdhocbf_drake.estimation.met_ground import meet
from pdhocbf_drake.estimation.sample import Notice

_TILT = 0.02  # share of a tick by which the tilt follows that of the standing foot
_BIAS = 0.005  # and the gyroscope's bias the rate of the standing foot
_VELOCITY = 0.2  # and the velocity that of the legs, whose rates are late by the encoders' low-pass


class AnchorFilter(BaseFilter):
    """The base counted from the feet that stand, in shares of the load that they carry.

    R follows the gyroscope, its tilt slowly that of the sole, κ (R F e_z) × e_z, and the gyroscope's bias the sole's
    rate; p = d − R s; v follows the accelerometer, and soon −R (ω × s + ∂s/∂θ θ̇). It has no covariance.
    """

    def _spread(self, memory: Memory) -> None:
        """There is none."""

    def _correct(
        self, memory: Memory, spins: np.ndarray, rate: np.ndarray, rates: np.ndarray
    ) -> tuple[float, int, Notice]:
        legs, estimate = self.legs, memory.estimate
        stood = memory.standing > 0.0
        found = [self._stands(memory, side, spins[side]) for side in (0, 1)]
        memory.standing[:] = [stands for stands, _ in found]
        notice = found[0][1] | found[1][1]
        loads = np.where(stood & (memory.standing > 0.0), np.maximum(memory.force_torque[5::6], 1.0), 0.0)
        if loads.any():
            loads /= loads.sum()
            estimate[GYRO_BIAS:ACCELEROMETER_BIAS] += _BIAS * (loads @ spins)
            rotation, turn, step = estimate[R:V].reshape(3, 3), np.zeros(3), np.empty(9)
            normals = legs.turns.reshape(2, 3, 3)[:, :, 2] @ rotation.T
            x, y, _ = loads @ normals
            for side in np.flatnonzero(loads).tolist():
                seen = np.array([*normals[side, :2], estimate[SOLES + 3 * side + 2]])
                tilted = loads[side] * meet(memory.ground, side, seen)
                x, y = x - tilted[0], y - tilted[1]
            turn[:2] = _TILT * y, -_TILT * x
            kernels.write_exp(turn, step)
            rotation[:] = step.reshape(3, 3) @ rotation
            places, velocity = np.zeros(3), np.zeros(3)
            for side, share in enumerate(loads.tolist()):
                sole = estimate[SOLES + 3 * side : SOLES + 3 * side + 3]
                height = memory.ground[side, 2] if share else 0.0
                places += share * (np.array([sole[0], sole[1], height]) - rotation @ legs.ways[side])
                velocity -= share * (np.cross(rate, legs.ways[side]) + legs.way_rates[side] @ rates)
            estimate[P : P + 3] = places
            estimate[V:P] += _VELOCITY * (rotation @ velocity - estimate[V:P])
        for side in (0, 1):
            if not loads[side]:
                memory.ground[side] = np.nan
                self._place(memory, side)
        memory.covariance[:] = 0.0
        return 0.0, 0, notice if memory.standing.any() else notice | Notice.IN_THE_AIR
