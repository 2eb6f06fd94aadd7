"""Sensors that read the plant at its own steps and hand on the mean over a tick: IMU, and forces above the soles."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.estimation.config import ForceTorqueConfig, ImuConfig
from pdhocbf_drake.estimation.kernels import write_imu
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.signals import size, sizes

_AXES = 6


class Imu(Block):
    """Mean rate and specific force over a tick, of samples that are means themselves.

    A sample is mean + bias + white noise, clipped to the range and rounded to bits. The samples of a tick are joined
    as a strapdown unit does: ΔR ← ΔR exp(ω T), Δv ← Δv + ΔR exp(½ ω T) f T. The sample that ends now is part of
    what is handed on, and state only from the next instant on: there is no delay.

    Input ports:
        integrals (6): of angular rate [rad] and specific force [m/s].
        noise (12): standard normal numbers, of white noise and bias walk.
    Output parts, see `unbundled`:
        imu (9): log(ΔR)/δ [rad/s] and Δv/δ [m/s²] in the axes at the tick's start, then the last sample's rate; zeros
            before the first tick has passed.

    Args:
        bias: of rate and specific force at the start (6,).
        tick: δ [s]. samples: in a tick.
    """

    def __init__(self, config: ImuConfig, bias: np.ndarray, tick: float, samples: int) -> None:
        super().__init__()
        self._samples, self._time = samples, tick / samples
        white = np.repeat([config.gyro_noise, config.accelerometer_noise], 3) / np.sqrt(self._time)
        walk = np.repeat([config.gyro_bias_walk, config.accelerometer_bias_walk], 3) * np.sqrt(self._time)
        most = np.repeat([config.gyro_range, config.accelerometer_range], 3)
        self._numbers = np.array([white, walk, most, most / 2.0 ** (config.bits - 1)])
        self._integrals = self.DeclareVectorInputPort("integrals", _AXES)
        self._noise = self.DeclareVectorInputPort("noise", 2 * _AXES)
        # Samples so far in this tick (−1 before the first), last integrals, bias, ΔR, Δv.
        start = np.concatenate([[-1.0], np.zeros(_AXES), bias, np.eye(3).ravel(), np.zeros(3)])
        self.DeclareDiscreteState(start)
        self.DeclarePeriodicDiscreteUpdateEvent(self._time, 0.0, self._update)
        self.parts = sizes("imu")
        self._all = self.parts["imu"] + len(start)  # the coming state stands behind the part
        prerequisites = {self._integrals.ticket(), self._noise.ticket(), self.xd_ticket()}
        self._joined = self.DeclareVectorOutputPort("joined", self._all, weakly(self._calc), prerequisites)

    def _calc(self, context: Context, output: BasicVector) -> None:
        state, joined = context.get_discrete_state_vector().value(), np.empty(self._all)
        integrals, noise = self._integrals.Eval(context), self._noise.Eval(context)
        write_imu(state, integrals, noise, self._numbers, self._samples, self._time, joined)
        output.SetFromVector(joined)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._joined.Eval(context)[self.parts["imu"] :])


class SoleWrenches(Block):
    """The ground's moments and forces on both soles from the reactions in the joints above them.

    The foot's weight below the sensor is taken off as of a level foot at rest: what is left is exact in a stand.

    Input ports:
        reaction_forces: of the plant.
    Output ports:
        sole_wrenches (12): moment about the sole's centre [N m], then force [N], in the sole's axes; left, then right.

    Args:
        joints: the joint's place among the reactions, the sole in the joint's frame on the foot, and weight [N] and
            centre of mass in the sole (3,) [m] of the foot; left, then right.
    """

    def __init__(self, joints: list[tuple[int, RigidTransform, float, np.ndarray]]) -> None:
        super().__init__()
        self._joints = [
            (place, sole.rotation().matrix().T, sole.translation().tolist(), weight, centre)
            for place, sole, weight, centre in joints
        ]
        self._reactions = self.DeclareAbstractInputPort("reaction_forces", AbstractValue.Make([SpatialForce.Zero()]))
        self.DeclareVectorOutputPort("sole_wrenches", size("force_torque"), weakly(self._calc))

    def _calc(self, context: Context, output: BasicVector) -> None:
        reactions, found = self._reactions.Eval(context), np.empty(2 * _AXES)
        for start, (place, turn, origin, weight, centre) in zip((0, _AXES), self._joints, strict=True):
            moment, force = -reactions[place].rotational(), -reactions[place].translational()
            (x, y, z), (fx, fy, fz) = origin, force.tolist()
            found[start : start + 3] = turn @ (moment - [y * fz - z * fy, z * fx - x * fz, x * fy - y * fx])
            found[start + 3 : start + 6] = turn @ force
            found[start] += weight * centre[1]
            found[start + 1] -= weight * centre[0]
            found[start + 5] += weight
        output.SetFromVector(found)


class ForceTorque(Block):
    """The mean over a tick of both soles' wrenches, with offset and noise, clipped to the range and rounded.

    Input ports:
        integrals (12): of the sole's wrenches [N m s, N s].
        noise (12): standard normal numbers.
    Output ports:
        force_torque (12): as `SoleWrenches`; zeros before the first tick has passed.

    Args:
        offset: of the twelve numbers [N m, N].
        tick: δ [s].
    """

    def __init__(self, config: ForceTorqueConfig, offset: np.ndarray, tick: float) -> None:
        super().__init__()
        self._offset, self._tick, self._most = offset, tick, config.force_range
        self._deviation = np.tile(np.repeat([config.torque_noise, config.force_noise], 3), 2)
        steps = np.tile(np.repeat([config.torque_resolution, config.force_resolution], 3), 2)
        self._steps = np.where(steps > 0.0, steps, 1e-12)
        self._integrals = self.DeclareVectorInputPort("integrals", 2 * _AXES)
        self._noise = self.DeclareVectorInputPort("noise", 2 * _AXES)
        self.DeclareDiscreteState(np.full(2 * _AXES, np.nan))
        self.DeclarePeriodicDiscreteUpdateEvent(tick, 0.0, self._update)
        self.DeclareVectorOutputPort("force_torque", 2 * _AXES, weakly(self._calc))

    def _calc(self, context: Context, output: BasicVector) -> None:
        last = context.get_discrete_state_vector().value()
        if np.isnan(last[0]):
            output.SetFromVector(np.zeros(2 * _AXES))
            return
        mean = (self._integrals.Eval(context) - last) / self._tick
        mean += self._offset + self._deviation * self._noise.Eval(context)
        mean = self._steps * np.round(mean / self._steps)
        mean[[5, 11]] = np.clip(mean[[5, 11]], -self._most, self._most)
        output.SetFromVector(mean)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        values.set_value(self._integrals.Eval(context))
