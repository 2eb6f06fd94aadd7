"""The rows of the table: what differs from an exact measurement and an exact model, and what must be reached then."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from pdhocbf_drake.estimation import Notice


class Row(NamedTuple):
    """A way to be wrong about the robot.

    Attributes:
        changes: keys of the scenario.
        speed: least share of the commanded speed; None judges falls alone [%].
        zmp: most percentage points of ticks with the ZMP outside its box, more than in an exact walk; None is no limit.
        duration: of the walk [s].
        estimate: whether the estimator's errors are judged.
        notice: what the estimator must find wrong with its sensors.
    """

    changes: dict[str, Any]
    speed: float | None = None
    zmp: float | None = None
    duration: float = 12.0
    estimate: bool = False
    notice: Notice | None = None


def _late(true: int, stated: int) -> Row:
    return Row({"measurement": {"delay_ticks": true}, "mpc": {"delay": stated}})


def _wrong(**changes: Any) -> Row:
    return Row(changes, 97.0, 3.0, 20.0)


def _on_sensors(speed: float | None, duration: float, sensors: dict[str, Any] | None = None, **changes: Any) -> Row:
    """A walk on the sensors of `walking_sensors`, with differences."""
    measurement = {"source": "sensors", "delay_ticks": 1, **(sensors or {})}
    return Row({"measurement": measurement, **changes}, speed, None, duration, estimate=True)


def _failing(notice: Notice, sensor: str, kind: str, duration: float | None = None) -> Row:
    """One whose sensor fails at 3 s."""
    fault = {"time": _FAULT, "sensor": sensor, "kind": kind, "duration": duration}
    return _on_sensors(None, 8.0, {"faults": [fault]})._replace(estimate=False, notice=notice)


_FAULT = 3.05  # [s], in mid-swing of the packaged walks
_NOISY = {"gyro_noise": 2.4e-3, "gyro_bias": 0.035, "accelerometer_noise": 0.017, "accelerometer_bias": 1.0}
_TURNING = [{"time": 0.0, "velocity": [0.25, 0.0], "turn": 0.4}]
EXACT: Final = "exact"
_WEIGHED: Final = {"weigh": True}
_SHIFTS: Final = {"ahead": [0.02, 0.0, 0.0], "behind": [-0.02, 0.0, 0.0], "aside": [0.0, 0.02, 0.0]}  # [m]
ROWS: Final[dict[str, Row]] = {
    EXACT: Row({}, 98.0),
    **{f"late {10 * d} ms": Row({"measurement": {"delay_ticks": d}}, 98.0) for d in (1, 2, 3, 4)},
    **{f"late {10 * d} ms, stated {10 * s}": _late(d, s) for d, s in ((1, 0), (1, 2), (2, 1), (2, 3), (4, 3), (4, 5))},
    **{f"torso {m:g}": _wrong(model_error={"torso_mass": m}) for m in (0.8, 1.2, 1.3)},
    **{f"CoM {where}": _wrong(model_error={"com_shift": shift}) for where, shift in _SHIFTS.items()},
    **{f"torso {m:g}, weighed": _wrong(model_error={"torso_mass": m}, biped=_WEIGHED) for m in (0.8, 1.3)},
    "CoM ahead, weighed": _wrong(model_error={"com_shift": _SHIFTS["ahead"]}, biped=_WEIGHED),
    "CoM behind, late 40 ms": _wrong(
        model_error={"com_shift": _SHIFTS["behind"]}, measurement={"delay_ticks": 4}
    )._replace(zmp=None),
    "slope": _wrong(model_error={"gravity_tilt_deg": [2.0, 0.0]}),
    "wind": _wrong(wind=[-10.0, 0.0]),
    "noise": Row({"measurement": {"noise": {"com": 0.005, "velocity": 0.05}}}, 97.0, None, 60.0),
    "noise, late": Row(
        {"measurement": {"noise": {"com": 0.005, "velocity": 0.05}, "delay_ticks": 1}}, 97.0, None, 60.0
    ),
    "sensors": _on_sensors(98.0, 60.0),
    "sensors, stride 0.2 m": _on_sensors(98.0, 60.0, gait={"stride": 0.2}),
    "sensors, stride 0 m": _on_sensors(None, 60.0, gait={"stride": 0.0}),
    "sensors, stride 0.05 m": _on_sensors(98.0, 60.0, gait={"stride": 0.05}),
    "sensors, turning": _on_sensors(None, 60.0, commands=_TURNING),
    "sensors, not calibrated": _on_sensors(95.0, 12.0, {"encoders": {"calibrated": None}})._replace(estimate=False),
    "sensors, IMU noise × 10": _on_sensors(None, 12.0, {"imu": _NOISY})._replace(estimate=False),
    "sensors, sampled drives": _on_sensors(95.0, 12.0, {"drives": "sampled"})._replace(estimate=False),
    "sensors, anchor": _on_sensors(95.0, 12.0, {"estimator": {"kind": "anchor"}})._replace(estimate=False),
    "gyroscope stuck": _failing(Notice.GYROSCOPE, "gyroscope", "stuck"),
    "encoder stuck": _failing(Notice.ENCODER, "left_knee_pitch", "stuck"),
    "force sensor at zero": _failing(Notice.FORCE_TORQUE, "left_force_torque", "zero"),
    "IMU lost, 50 ms": _failing(Notice.GYROSCOPE | Notice.ACCELEROMETER, "imu", "lost", 0.05),
    "IMU lost, 1 s": _failing(Notice.GYROSCOPE | Notice.ACCELEROMETER, "imu", "lost", 1.0),
    "contact flicker": _failing(Notice.FLICKER, "left_force_torque", "flicker", 1.0),
    "slip": _on_sensors(None, 8.0, friction=0.2, friction_belief=0.8)._replace(estimate=False, notice=Notice.SLIP),
}
"""By name, in the order of the table."""
