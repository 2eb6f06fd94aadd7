"""One tick of an estimator of the floating base, from what the sensors say to what is handed on."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np

from pdhocbf_drake.estimation import kernels
from pdhocbf_drake.estimation.checks import notice_imu, trusted_encoders, trusted_forces
from pdhocbf_drake.estimation.config import SensorsConfig
from pdhocbf_drake.estimation.contacts import notice_contacts
from pdhocbf_drake.estimation.handed_on import hand_on, hold_stance
from pdhocbf_drake.estimation.kernels import ACCELEROMETER_BIAS, GYRO_BIAS, P, R, V
from pdhocbf_drake.estimation.legs import Legs
from pdhocbf_drake.estimation.memory import Memory
from pdhocbf_drake.estimation.sample import Estimate, Notice, Sample
from pdhocbf_drake.robot import Biped

_LEG_RATE, _LEG_FORCE = 0.1, 2.0  # deviation of a tick's mean rate and force by the joints of a leg [rad/s, m/s²]
_LEAST_LOAD = 0.0035  # share of the weight with which there is a ZMP


class BaseFilter(ABC):
    """The IMU leads the estimate on, and the feet that stand correct it; it never raises, whatever the sensors say.

    It starts from a stand with both soles flat, at any place and heading, with any tilt of the base. Place and heading
    can't be observed: they are those of the start, and drift.

    Args:
        biped: the robot.
        config: of sensors and estimator.
        tick: δ [s].
        start: x, y of the middle between the soles, and their mean heading, at the first tick [m, rad].
    """

    def __init__(
        self, biped: Biped, config: SensorsConfig, tick: float = 0.01, start: tuple[float, float, float] = (0.0,) * 3
    ) -> None:
        self.config, self.legs, self._tick, self._start = config, Legs(biped), tick, start
        self._gravity = biped.plant.gravity_field().gravity_vector()
        imu, slip = config.imu, config.estimator.slip
        densities = imu.gyro_noise, imu.accelerometer_noise, slip, imu.gyro_bias_walk, imu.accelerometer_bias_walk
        self._noise = np.square(densities)

    @abstractmethod
    def _spread(self, memory: Memory) -> None:
        """Sets the covariance at the first tick, where base and soles are placed."""

    @abstractmethod
    def _correct(
        self, memory: Memory, spins: np.ndarray, rate: np.ndarray, rates: np.ndarray
    ) -> tuple[float, int, Notice]:
        """Corrects the estimate by the feet that stand, and puts the others where the joints place them.

        Args:
            spins: the soles' mean rates, see `write_spin` (2, 3) [rad/s].
            rate: the base's own at this tick, less its bias (3,) [rad/s]. rates: the joints' (12,) [rad/s].

        Returns:
            Squared innovations, their number, and what is wrong with the feet.
        """

    def step(self, memory: Memory, sample: Sample) -> tuple[Memory, Estimate]:
        """The memory after a tick, and what is estimated at it; the memory that is given stays as it is."""
        memory, legs, config = Memory(memory.vector), self.legs, self.config
        encoders, notice = trusted_encoders(memory, sample, config)
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
            rate = imu[6:] - memory.estimate[GYRO_BIAS:ACCELEROMETER_BIAS]
            nis, count, slipped = self._correct(memory, spins, rate, encoders[12:])
            notice |= slipped
        memory.turns[:] = legs.turns
        hold_stance(memory)
        status = notice, nis, count
        return memory, hand_on(memory, legs, encoders[12:], imu[6:], _LEAST_LOAD * legs.weight, status)

    def _spins(self, memory: Memory, imu: np.ndarray) -> np.ndarray:
        """Mean rates of both soles over the tick, in the base's axes at its start (2, 3) [rad/s]."""
        rate, spins = imu[:3] - memory.estimate[GYRO_BIAS:ACCELEROMETER_BIAS], np.empty((2, 3))
        for side in (0, 1):
            kernels.write_spin(rate, self._tick, memory.turns[side], self.legs.turns[side], spins[side])
        return spins

    def _stands(self, memory: Memory, side: int, spin: np.ndarray) -> tuple[bool, Notice]:
        """Whether a foot carries load and stands still; one that turns rocks about an edge, or slips."""
        feet = self.config.estimator
        if not memory.loaded[side] or not math.hypot(*spin.tolist()) < feet.gate:
            return False, Notice.NONE
        slips = abs(float(memory.estimate[R + 6 : V] @ spin)) > feet.slip_gate
        return not slips, Notice.SLIP if slips else Notice.NONE

    def _by_the_leg(
        self, memory: Memory, sample: Sample, encoders: np.ndarray, faults: Notice
    ) -> tuple[np.ndarray, np.ndarray]:
        """What the IMU would say if the foot that carries most stood still, where the IMU fails; and its noise.

        Where no foot stands, the base goes on as it moves.
        """
        legs, estimate, imu, noise = self.legs, memory.estimate, sample.imu.copy(), self._noise.copy()
        rotation = estimate[R : R + 9].reshape(3, 3)
        side = int(np.argmax(memory.standing * (1.0 + memory.force_torque[5::6])))
        stands, spin = bool(memory.standing[side]), np.zeros(3)
        if faults & Notice.GYROSCOPE:
            if stands:
                before, now = memory.turns[side], legs.turns[side]
                kernels.write_spin(spin.copy(), self._tick, before, now, spin)
            imu[:3] = estimate[GYRO_BIAS:ACCELEROMETER_BIAS] - spin
            imu[6:], noise[0] = imu[:3], self._tick * _LEG_RATE**2
        if faults & Notice.ACCELEROMETER:
            force = -rotation.T @ self._gravity
            if stands:
                rate = imu[:3] - estimate[GYRO_BIAS:ACCELEROMETER_BIAS]
                velocity = -(np.cross(rate, legs.ways[side]) + legs.way_rates[side] @ encoders[12:])
                force += (velocity - rotation.T @ estimate[V : V + 3]) / self._tick
            imu[3:6] = force + estimate[ACCELEROMETER_BIAS : ACCELEROMETER_BIAS + 3]
            noise[1] = self._tick * _LEG_FORCE**2
        return imu, noise

    def _begin(self, memory: Memory) -> None:
        """Both soles flat on the ground, their middle and their mean heading those of the start."""
        legs, estimate = self.legs, memory.estimate
        x, y, yaw = self._start
        up, ahead = legs.turns.reshape(2, 3, 3).sum(axis=0)[:, [2, 0]].T
        up = up / max(float(np.linalg.norm(up)), 1e-12)
        ahead = ahead - (up @ ahead) * up
        ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-12)
        level, turn = np.array([ahead, np.cross(up, ahead), up]), np.empty(9)
        kernels.write_exp(np.array([0.0, 0.0, yaw]), turn)
        rotation = turn.reshape(3, 3) @ level
        estimate[:], memory.covariance[:] = 0.0, 0.0
        estimate[R:V] = rotation.ravel()
        estimate[P : P + 3] = np.array([x, y, 0.0]) - rotation @ legs.ways.mean(axis=0)
        self._spread(memory)
        for side in (0, 1):
            self._place(memory, side)
        memory.started[:], memory.loaded[:], memory.standing[:] = 1.0, 1.0, 1.0
        memory.above[:], memory.repeats[:], memory.changes[:] = self.config.estimator.hold_ticks, 0.0, 0.0
        memory.anchor[:] = 0.0, np.nan, np.nan, 0.0, 0.0

    def _place(self, memory: Memory, side: int) -> None:
        """Puts a sole where the joints place it."""
        legs, variance = self.legs, self.config.estimator.kinematics**2
        estimate, covariance = memory.estimate, memory.covariance
        kernels.place_sole(estimate, covariance, side, legs.ways[side], legs.way_rates[side], variance)
