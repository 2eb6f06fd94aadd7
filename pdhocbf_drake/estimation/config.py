"""Config of the sensors and of the estimator that reads them."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from pdhocbf_drake.config import Config, within

Rate = Annotated[float, within(1.0, 1e5, "Hz")]
_Density = Annotated[float, within(0.0, 10.0, "unit/√Hz")]
Sensor = Literal[
    "gyroscope", "accelerometer", "imu", "encoders", "left_force_torque", "right_force_torque",
    "left_hip_yaw", "left_hip_roll", "left_hip_pitch", "left_knee_pitch", "left_ankle_pitch", "left_ankle_roll",
    "right_hip_yaw", "right_hip_roll", "right_hip_pitch", "right_knee_pitch", "right_ankle_pitch", "right_ankle_roll",
]  # fmt: skip
_Angle = Annotated[float, within(0.0, 1.0, "rad")]


class ImuConfig(Config):
    """An inertial measurement unit in the floating link's origin; the defaults are those of a Bosch BMI088.

    Densities are one-sided, of rate and acceleration; a bias is drawn once a run and walks from there.

    Attributes:
        rate: samples a second at most, each the mean over its interval, see `samples_in_tick` [Hz].
        gyro_noise: noise density [rad/s/√Hz]; 0.014 °/s/√Hz.
        gyro_bias: standard deviation of the bias at the start [rad/s]; 0.2 °/s, after a coarse calibration.
        gyro_bias_walk: density of the bias's rate [rad/s²/√Hz].
        gyro_range: largest rate [rad/s]; 2000 °/s.
        accelerometer_noise: noise density [m/s²/√Hz]; 175 µg/√Hz.
        accelerometer_bias: standard deviation of the bias at the start [m/s²]; 10 mg, half of the largest offset.
        accelerometer_bias_walk: density of the bias's rate [m/s³/√Hz].
        accelerometer_range: largest specific force [m/s²]; 24 g.
        bits: of a sample over its range, of either sign [1].
        delay_ticks: delay [ticks].
    """

    rate: Rate = 500.0
    gyro_noise: _Density = 2.4e-4
    gyro_bias: Annotated[float, within(0.0, 1.0, "rad/s")] = 3.5e-3
    gyro_bias_walk: _Density = 2e-5
    gyro_range: Annotated[float, within(0.1, 1e3, "rad/s")] = 34.9
    accelerometer_noise: _Density = 1.7e-3
    accelerometer_bias: Annotated[float, within(0.0, 10.0, "m/s²")] = 0.1
    accelerometer_bias_walk: _Density = 3e-4
    accelerometer_range: Annotated[float, within(1.0, 1e4, "m/s²")] = 235.0
    bits: int = Field(16, ge=2, le=32)
    delay_ticks: int = Field(0, ge=0, le=100)


class EncoderConfig(Config):
    """The joints' absolute encoders; the defaults are those of an RLS AksIM-2 of 17 bits.

    Attributes:
        rate: samples a second at most, from which rates are made, likewise [Hz].
        bits: of a revolution [1].
        offset: standard deviation of the zero positions as mounted [rad].
        calibrated: the same after calibration, which the estimator takes them for [rad]; null is not calibrated.
        cutoff: of the first-order low-pass through which the positions' differences are the rates [Hz].
        delay_ticks: delay [ticks].
    """

    rate: Rate = 1000.0
    bits: int = Field(17, ge=8, le=32)
    offset: _Angle = 0.003
    calibrated: _Angle | None = 0.001
    cutoff: Annotated[float, within(1.0, 1e4, "Hz")] = 40.0
    delay_ticks: int = Field(0, ge=0, le=100)

    @property
    def left_offset(self) -> float:
        """Standard deviation of what the estimator does not know of the zero positions [rad]."""
        return self.offset if self.calibrated is None else min(self.calibrated, self.offset)


class ForceTorqueConfig(Config):
    """A force and torque sensor above each sole; the defaults are those of an ATI Mini45 SI-580-20.

    Attributes:
        force_noise: standard deviation of a tick's mean force [N].
        torque_noise: of its mean torque [N m].
        force_offset: standard deviation of the force's offset after taring [N].
        torque_offset: of the torque's [N m].
        force_resolution: smallest step of the force [N].
        torque_resolution: smallest step of the torque [N m].
        force_range: largest force along the sole's normal [N].
        delay_ticks: delay [ticks].
    """

    force_noise: Annotated[float, within(0.0, 1e3, "N")] = 1.0
    torque_noise: Annotated[float, within(0.0, 1e2, "N m")] = 0.03
    force_offset: Annotated[float, within(0.0, 1e3, "N")] = 2.0
    torque_offset: Annotated[float, within(0.0, 1e2, "N m")] = 0.05
    force_resolution: Annotated[float, within(0.0, 1e2, "N")] = 0.25
    torque_resolution: Annotated[float, within(0.0, 1e1, "N m")] = 0.005
    force_range: Annotated[float, within(1.0, 1e6, "N")] = 1160.0
    delay_ticks: int = Field(0, ge=0, le=100)


def samples_in_tick(rate: float, tick: float, step: float) -> int:
    """Samples of a sensor in a tick: as many as its rate has, each of whole steps of the plant, and at least one.

    Args:
        rate: of the sensor [Hz]. tick: δ [s]. step: of the plant, which divides the tick [s].
    """
    steps, most = max(1, round(tick / step)), max(1.0, rate * tick + 1e-9)
    return max(count for count in range(1, steps + 1) if steps % count == 0 and count <= most)


class SensorFault(Config):
    """A sensor that fails for some time.

    Attributes:
        time: its start [s].
        duration: its length [s]; null is to the end.
        sensor: "gyroscope", "accelerometer", "imu" (both), "encoders" (all), the joint of one, such as
            "left_knee_pitch", "left_force_torque" or "right_force_torque".
        kind: "lost" says nothing (NaN), "stuck" repeats the last sample, "zero" says 0, and "flicker" says 0 at every
            other pair of ticks.
    """

    time: float = Field(ge=0)
    duration: float | None = Field(None, gt=0)
    sensor: Sensor
    kind: Literal["lost", "stuck", "zero", "flicker"]


class EstimatorConfig(Config):
    """What the estimator takes for granted of feet and ground; the sensors' noise it has from their configs.

    Attributes:
        kind: "ekf", the contact-aided invariant Kalman filter, or "anchor", which takes the standing foot for flat and
            at rest and blends nothing.
        kinematics: standard deviation of a sole's place from the joints, without the encoders' offsets [m].
        slip: density of a standing sole's motion [m/√s].
        flat: tilt of a standing sole against the ground [rad].
        foot_rate: rate of a standing sole about the vertical [rad/s].
        height: of a standing sole over level ground [m].
        gate: rate above which a loaded foot counts as rocking, and is not used [rad/s].
        slip_gate: rate about the vertical above which it counts as slipping, likewise [rad/s].
        load_on: load from which a foot is in contact, as a share of the weight [1].
        load_off: load below which it is not, likewise [1].
        hold_ticks: ticks in a row above `load_on` before it is in contact [ticks].
        tilt: standard deviation of the base's tilt at the start [rad].
    """

    kind: Literal["ekf", "anchor"] = "ekf"
    kinematics: Annotated[float, within(1e-6, 1.0, "m")] = 3e-4
    slip: Annotated[float, within(0.0, 1.0, "m/√s")] = 2e-3
    flat: Annotated[float, within(1e-6, 1.0, "rad")] = 5e-3
    foot_rate: Annotated[float, within(1e-6, 10.0, "rad/s")] = 0.015
    height: Annotated[float, within(1e-6, 1.0, "m")] = 2e-3
    gate: Annotated[float, within(1e-3, 100.0, "rad/s")] = 0.5
    slip_gate: Annotated[float, within(1e-3, 100.0, "rad/s")] = 0.1
    load_on: Annotated[float, within(0.0, 1.0, "of the weight", above=True)] = 0.14
    load_off: Annotated[float, within(0.0, 1.0, "of the weight")] = 0.07
    hold_ticks: int = Field(2, ge=1, le=100)
    tilt: Annotated[float, within(1e-6, math.pi, "rad")] = 0.05

    @model_validator(mode="after")
    def _hysteresis(self) -> EstimatorConfig:
        if self.load_off > self.load_on:
            raise ValueError(f"load_off must be at most load_on, {self.load_on:g} (given: {self.load_off:g})")
        return self


class SensorsConfig(Config):
    """All that the estimator reads, and how it reads it.

    Attributes:
        imu, encoders, force_torque: the sensors.
        estimator: what makes CoM, ZMP and soles of them.
        faults: of the sensors.
    """

    imu: ImuConfig = ImuConfig()
    encoders: EncoderConfig = EncoderConfig()
    force_torque: ForceTorqueConfig = ForceTorqueConfig()
    estimator: EstimatorConfig = EstimatorConfig()
    faults: tuple[SensorFault, ...] = ()

    @property
    def sensor_delay(self) -> int:
        """Delay of the estimate: that of the slowest sensor, since it is made from samples of one instant [ticks]."""
        return max(self.imu.delay_ticks, self.encoders.delay_ticks, self.force_torque.delay_ticks)
