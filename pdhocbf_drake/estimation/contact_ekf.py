"""The contact-aided invariant extended Kalman filter of a floating base with two feet."""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.estimation import kernels
from pdhocbf_drake.estimation.checks import notice_imu, trusted_encoders, trusted_forces
from pdhocbf_drake.estimation.config import SensorsConfig
from pdhocbf_drake.estimation.contacts import notice_contacts
from pdhocbf_drake.estimation.handed_on import hand_on, hold_stance
from pdhocbf_drake.estimation.kernels import (
    ACCELEROMETER_BIAS,
    DACCELEROMETER,
    DGYRO,
    DP,
    DV,
    ERRORS,
    GYRO_BIAS,
    OFFSETS,
    PHI,
    P,
    R,
    V,
)  # fmt: skip
from pdhocbf_drake.estimation.legs import Legs
from pdhocbf_drake.estimation.memory import Memory
from pdhocbf_drake.estimation.sample import Estimate, Notice, Sample
from pdhocbf_drake.robot import Biped

ROWS = 7
"""Of a standing foot: its place by the joints (3), its tilt (2), its height, its rate about the vertical."""

_SPEED = 0.02  # standard deviation of the base's velocity at the start [m/s]
_HEIGHT = 0.01  # and of its height [m]
_LEAST_OFFSET = 1e-5  # of an encoder [rad]: less would be more certain than the model of the legs
_GATE = 5.0  # standard deviations that a standing foot may be off before it counts as slipping
_LEG_RATE, _LEG_FORCE = 0.1, 2.0  # deviation of a tick's mean rate and force by the joints of a leg [rad/s, m/s²]
_LEAST_LOAD = 0.0035  # share of the weight with which there is a ZMP


class ContactEkf:
    """Base, soles and biases from IMU, encoders and sole forces, with the covariance of their errors.

    X = (R, v, p, d_left, d_right) with right-invariant error X̂ = exp(ξ) X, and biases of gyroscope and accelerometer.
    The IMU leads X on; of each foot that stands seven rows z = H ξ + noise correct it:

        R s(θ) − (d − p) = δp − δd + R ∂s/∂θ ε               the joints place the sole
        (R F(θ) e_z)_xy  = ((φ + R J_ω ε) × e_z)_xy           it is flat
        d_z              = (φ × d + δd)_z                     on level ground at height 0
        (R Ω)_z          = −(R δb)_z                          and does not turn about the vertical

    Here ε is the error of the encoders' zero positions, which is considered and not estimated, F the sole's rotation
    in the base, and Ω the sole's mean rate over the tick by gyroscope and joints. Place and yaw are not observable:
    they are those of the start, and drift. It never raises, whatever the sensors say.

    Args:
        biped: the robot.
        config: of sensors and estimator.
        tick: δ [s].
        start: x, y of the middle between the soles, and heading, when it starts from a stand [m, rad].
    """

    def __init__(
        self, biped: Biped, config: SensorsConfig, tick: float = 0.01, start: tuple[float, float, float] = (0.0,) * 3
    ) -> None:
        imu, feet = config.imu, config.estimator
        self._legs, self._config, self._tick, self._start = Legs(biped), config, tick, start
        self._gravity = biped.plant.gravity_field().gravity_vector()
        densities = imu.gyro_noise, imu.accelerometer_noise, feet.slip, imu.gyro_bias_walk, imu.accelerometer_bias_walk
        self._noise = np.square(densities)
        self._leg_noise = self._noise.copy()
        self._leg_noise[:2] = tick * np.square([_LEG_RATE, _LEG_FORCE])
        deviations = *[feet.kinematics] * 3, feet.flat, feet.flat, feet.height, feet.foot_rate
        self._variances = np.tile(np.square(deviations), 2)

    def step(self, memory: Memory, sample: Sample) -> tuple[Memory, Estimate]:
        """The memory after a tick, and what is estimated at it; the memory that is given stays as it is."""
        memory, legs, config = Memory(memory.vector), self._legs, self._config
        encoders, notice = trusted_encoders(memory, sample)
        legs.set_joints(encoders[:12])
        faults = notice_imu(memory, sample, config)
        trusted = trusted_forces(memory, sample, config, legs.weight)
        if not memory.started[0]:
            self._begin(memory)
            imu, notice = np.zeros(9), Notice.NONE
            nis, count = 0.0, 0
        else:
            notice |= faults | notice_contacts(memory, config.estimator, legs.weight, trusted, sample.support)
            imu, noise = (sample.imu, self._noise) if not faults else self._by_the_leg(memory, sample, encoders, faults)
            spins = self._spins(memory, imu)
            kernels.propagate(memory.estimate, memory.covariance, imu, self._gravity, self._tick, noise)
            nis, count, slipped = self._correct(memory, spins)
            notice |= slipped
        memory.turns[:] = legs.turns
        hold_stance(memory)
        status = notice, nis, count
        return memory, hand_on(memory, legs, encoders[12:], imu[6:], _LEAST_LOAD * legs.weight, status)

    def _spins(self, memory: Memory, imu: np.ndarray) -> np.ndarray:
        """Mean rates of both soles over the tick, in the base's axes at its start (2, 3) [rad/s]."""
        rate, spins = imu[:3] - memory.estimate[GYRO_BIAS : GYRO_BIAS + 3], np.empty((2, 3))
        for side in (0, 1):
            kernels.write_spin(rate, self._tick, memory.turns[side], self._legs.turns[side], spins[side])
        return spins

    def _correct(self, memory: Memory, spins: np.ndarray) -> tuple[float, int, Notice]:
        """Corrects by the feet that stand, and puts the others where the joints place them.

        Returns:
            Squared innovations, their number, and what is wrong with the feet.
        """
        legs, feet, notice = self._legs, self._config.estimator, Notice.NONE
        rows, residuals, count = np.empty((2 * ROWS, ERRORS)), np.empty(2 * ROWS), 0
        for side in (0, 1):
            stood = memory.standing[side]
            stands = memory.loaded[side] and math.hypot(*spins[side].tolist()) < feet.gate
            memory.standing[side] = stands
            if stands and stood:
                part = slice(count, count + ROWS)
                kernels.write_rows(
                    memory.estimate, side, legs.ways[side], legs.way_rates[side], legs.turns[side],
                    legs.turn_rates[side], spins[side], rows[part], residuals[part],
                )  # fmt: skip
                places = slice(count, count + 3)
                off = kernels.farthest(memory.covariance, rows[places], residuals[places], self._variances[places])
                if off < _GATE:
                    count += ROWS
                    continue
                notice |= Notice.SLIP
            self._place(memory, side)
        nis = kernels.update(
            memory.estimate, memory.covariance, rows[:count], residuals[:count], self._variances[:count]
        )
        return nis, count, notice if memory.standing.any() else notice | Notice.IN_THE_AIR

    def _place(self, memory: Memory, side: int) -> None:
        legs, variance = self._legs, self._variances[0]
        kernels.place_sole(memory.estimate, memory.covariance, side, legs.ways[side], legs.way_rates[side], variance)

    def _by_the_leg(
        self, memory: Memory, sample: Sample, encoders: np.ndarray, faults: Notice
    ) -> tuple[np.ndarray, np.ndarray]:
        """What the IMU would say if the foot that carries most stood still, where the IMU fails; and its noise.

        Where no foot stands, the base goes on as it moves.
        """
        legs, estimate, imu, noise = self._legs, memory.estimate, sample.imu.copy(), self._noise.copy()
        rotation = estimate[R : R + 9].reshape(3, 3)
        side = int(np.argmax(memory.standing * (1.0 + memory.force_torque[5::6])))
        stands, spin = bool(memory.standing[side]), np.zeros(3)
        if faults & Notice.GYROSCOPE:
            if stands:
                before, now = memory.turns[side], legs.turns[side]
                kernels.write_spin(spin.copy(), self._tick, before, now, spin)
            imu[:3] = estimate[GYRO_BIAS : GYRO_BIAS + 3] - spin
            imu[6:], noise[0] = imu[:3], self._leg_noise[0]
        if faults & Notice.ACCELEROMETER:
            force = -rotation.T @ self._gravity
            if stands:
                rate = imu[:3] - estimate[GYRO_BIAS : GYRO_BIAS + 3]
                velocity = -(np.cross(rate, legs.ways[side]) + legs.way_rates[side] @ encoders[12:])
                force += (velocity - rotation.T @ estimate[V : V + 3]) / self._tick
            imu[3:6] = force + estimate[ACCELEROMETER_BIAS : ACCELEROMETER_BIAS + 3]
            noise[1] = self._leg_noise[1]
        return imu, noise

    def _begin(self, memory: Memory) -> None:
        """Both soles flat on the ground, their middle and their mean heading those of the start."""
        legs, feet, imu = self._legs, self._config.estimator, self._config.imu
        x, y, yaw = self._start
        up, ahead = legs.turns.reshape(2, 3, 3).sum(axis=0)[:, [2, 0]].T
        up = up / max(float(np.linalg.norm(up)), 1e-12)
        ahead = ahead - (up @ ahead) * up
        ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-12)
        level, turn = np.array([ahead, np.cross(up, ahead), up]), np.empty(9)
        kernels.write_exp(np.array([0.0, 0.0, yaw]), turn)
        rotation = turn.reshape(3, 3) @ level
        estimate, covariance = memory.estimate, memory.covariance
        estimate[:], covariance[:] = 0.0, 0.0
        estimate[R : R + 9] = rotation.ravel()
        estimate[P : P + 3] = np.array([x, y, 0.0]) - rotation @ legs.ways.mean(axis=0)
        offset = max(self._config.encoders.left_offset, _LEAST_OFFSET)
        for first, deviation in (
            (DV, _SPEED), (DGYRO, imu.gyro_bias), (DACCELEROMETER, imu.accelerometer_bias), *[
                (place, offset) for place in range(OFFSETS, ERRORS, 3)
            ],
        ):  # fmt: skip
            np.fill_diagonal(covariance[first : first + 3, first : first + 3], deviation**2)
        covariance[PHI, PHI] = covariance[PHI + 1, PHI + 1] = feet.tilt**2
        covariance[DP + 2, DP + 2] = _HEIGHT**2
        # The base tilts about itself: seen from the world's origin, that moves it by φ × p.
        arm = np.zeros((DP + 3, 3))
        kernels.set_skew(estimate[P : P + 3], 1.0, DP, PHI, arm)
        kernels.carry(arm, covariance)
        for side in (0, 1):
            self._place(memory, side)
        memory.started[:], memory.loaded[:], memory.standing[:] = 1.0, 1.0, 1.0
        memory.above[:], memory.repeats[:], memory.changes[:] = feet.hold_ticks, 0.0, 0.0
        memory.anchor[:] = 0.0, np.nan, np.nan, 0.0, 0.0
