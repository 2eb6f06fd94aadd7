"""The contact-aided invariant extended Kalman filter of a floating base with two feet."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.estimation import kernels
from pdhocbf_drake.estimation.base_filter import BaseFilter
from pdhocbf_drake.estimation.config import SensorsConfig
from pdhocbf_drake.estimation.kernels import DACCELEROMETER, DGYRO, DP, DV, ERRORS, OFFSETS, PHI, P
from pdhocbf_drake.estimation.memory import Memory
from pdhocbf_drake.estimation.met_ground import meet
from pdhocbf_drake.estimation.sample import Notice
from pdhocbf_drake.robot import Biped

ROWS = 7
"""Of a standing foot: its place by the joints (3), its tilt (2), its height, its rate about the vertical."""

_SPEED = 0.02  # standard deviation of the base's velocity at the start [m/s]
_HEIGHT = 0.01  # and of its height [m]
_LEAST_OFFSET = 1e-5  # of an encoder [rad]: less would be more certain than the model of the legs
_GATE = 5.0  # standard deviations that a standing foot may be off before it counts as slipping


class ContactEkf(BaseFilter):
    """Base, soles and biases from IMU, encoders and sole forces, with the covariance of their errors.

    X = (R, v, p, d_left, d_right) with right-invariant error X̂ = exp(ξ) X, and biases of gyroscope and accelerometer.
    The IMU leads X on; of each foot that stands seven rows z = H ξ + noise correct it:

        R s(θ) − (d − p) = δp − δd + R ∂s/∂θ ε               the joints place the sole
        (R F(θ) e_z)_xy  = ((φ + R J_ω ε) × e_z)_xy           it is flat
        d_z              = (φ × d + δd)_z                     on level ground at height 0 (else less what `meet` says)
        (R Ω)_z          = −(R δb)_z                          and does not turn about the vertical

    Here ε is the error of the encoders' zero positions, which is considered and not estimated, F the sole's rotation
    in the base, and Ω the sole's mean rate over the tick by gyroscope and joints.
    """

    def __init__(
        self, biped: Biped, config: SensorsConfig, tick: float = 0.01, start: tuple[float, float, float] = (0.0,) * 3
    ) -> None:
        super().__init__(biped, config, tick, start)
        feet = config.estimator
        deviations = *[feet.kinematics] * 3, feet.flat, feet.flat, feet.height, feet.foot_rate
        self._variances = np.tile(np.square(deviations), 2)

    def _spread(self, memory: Memory) -> None:
        """Tilt, height, velocity, biases and offsets are uncertain; place and heading are those of the start."""
        covariance, imu = memory.covariance, self.config.imu
        offset = max(self.config.encoders.left_offset, _LEAST_OFFSET)
        diagonal = np.zeros(ERRORS)
        diagonal[PHI : PHI + 2], diagonal[DV:DP], diagonal[DP + 2] = self.config.estimator.tilt, _SPEED, _HEIGHT
        diagonal[DGYRO:DACCELEROMETER], diagonal[DACCELEROMETER:OFFSETS] = imu.gyro_bias, imu.accelerometer_bias
        diagonal[OFFSETS:] = offset
        np.fill_diagonal(covariance, np.square(diagonal))
        # The base tilts about itself: seen from the world's origin, that moves it by φ × p.
        arm = np.zeros((DP + 3, 3))
        kernels.set_skew(memory.estimate[P : P + 3], 1.0, DP, PHI, arm)
        kernels.carry(arm, covariance)

    def _correct(
        self, memory: Memory, spins: np.ndarray, rate: np.ndarray, rates: np.ndarray
    ) -> tuple[float, int, Notice]:
        legs, notice = self.legs, Notice.NONE
        rows, residuals, count = np.empty((2 * ROWS, ERRORS)), np.empty(2 * ROWS), 0
        for side in (0, 1):
            stood = memory.standing[side]
            stands, slips = self._stands(memory, side, spins[side])
            notice |= slips
            memory.standing[side] = stands
            if stands and stood:
                part = slice(count, count + ROWS)
                kernels.write_rows(
                    memory.estimate, side, legs.ways[side], legs.way_rates[side], legs.turns[side],
                    legs.turn_rates[side], spins[side], rows[part], residuals[part],
                )  # fmt: skip
                met = slice(count + 3, count + 6)
                residuals[met] -= meet(memory.ground, side, residuals[met])
                places = slice(count, count + 3)
                off = kernels.farthest(memory.covariance, rows[places], residuals[places], self._variances[places])
                if off < _GATE:
                    count += ROWS
                    continue
                notice |= Notice.SLIP
                memory.standing[side] = 0.0
            memory.ground[side] = np.nan
            self._place(memory, side)
        nis = kernels.update(
            memory.estimate, memory.covariance, rows[:count], residuals[:count], self._variances[:count]
        )
        return nis, count, notice if memory.standing.any() else notice | Notice.IN_THE_AIR
