"""How far the estimate from the sensors is from the truth: drift, RMS errors, consistency, contacts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis.feet import TOUCHES, sole_corners
from pdhocbf_drake.analysis.metrics_schema import EstimatorMetrics
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.estimation.sample import Notice
from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.simulation.run_log import RunLog

Array = NDArray[np.float64]

NEES_LIMIT = 15.5
"""95 % of χ² with eight degrees of freedom, see `estimation.errors`."""

_LEAST_WAY = 0.1  # [m]: the drift of a shorter walk is no share of its way


def estimator_metrics(log: RunLog, limits: RobotLimits, window: int) -> EstimatorMetrics | None:
    """The errors of a log; None where the controller had the true state.

    Args:
        window: ticks of a gait, over which positions and NEES are averaged.
    """
    if "lip_estimate" not in log or len(log) < 2:
        return None
    errors = log["lip_estimate"] - log["lip_state"]
    window = min(window, len(log) // 2)
    way = _length(log["lip_state"][:, [0, 3]], window)
    drift = position_drift(log, window)
    yaw = np.degrees(yaw_errors(log))
    minutes = float(log.time[-1] - log.time[0]) * (len(log) - window) / len(log) / 60.0
    nees = window_means(log.element("estimate_error", "nees"), window)
    notices = log.element("estimator_status", "notice").astype(int)
    return EstimatorMetrics(
        position_drift=drift / way if way > _LEAST_WAY else None,
        yaw_drift_deg_per_minute=float(abs(yaw[-window:].mean() - yaw[:window].mean()) / minutes),
        velocity_rms=[_rms(errors[:, 1]), _rms(errors[:, 4])],
        height_rms=_rms(log.element("com_z_estimate", "z") - log.element("com_z", "z")),
        nees=float(nees.mean()),
        nees_within=float((nees <= NEES_LIMIT).mean()),
        contact_errors=_contact_errors(log, limits),
        notices={str(notice.name).lower(): int(n) for notice in Notice if (n := (notices & notice != 0).sum())},
    )


def position_drift(log: RunLog, window: int) -> float:
    """How far the estimated CoM has drifted off the true one, from the first to the last window [m]."""
    errors = (log["lip_estimate"] - log["lip_state"])[:, [0, 3]]
    return float(np.linalg.norm(errors[-window:].mean(axis=0) - errors[:window].mean(axis=0)))


def yaw_errors(log: RunLog) -> Array:
    """Heading of the floating link as estimated less the true one, without jumps, (T,) [rad]."""
    w, x, y, z = log["robot_state"][:, :4].T
    ahead = np.array([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)])
    estimated = np.array([log.element("base_estimate", "r11"), log.element("base_estimate", "r21")])
    sine = ahead[0] * estimated[1] - ahead[1] * estimated[0]
    return np.unwrap(np.arctan2(sine, (ahead * estimated).sum(axis=0)))


def window_means(values: Array, window: int) -> Array:
    """The mean over each whole window, one after another."""
    count = len(values) // window
    means: Array = values[len(values) - count * window :].reshape(count, window).mean(axis=1)
    return means


def _length(places: Array, window: int) -> float:
    """Length of the way (T, 2) without the sway of a gait [m]."""
    means = np.column_stack([window_means(column, window) for column in places.T])
    return float(np.linalg.norm(np.diff(means, axis=0), axis=1).sum())


def _contact_errors(log: RunLog, limits: RobotLimits) -> float:
    """Share of feet and ticks at which a foot counts as loaded though nothing of it touches, or the other way."""
    wrong = []
    for index, side in enumerate(SIDES):
        if "foot_load" in log:
            touches = np.asarray(log.element("foot_load", side) > 0.0)
        else:
            touches = np.asarray((sole_corners(log, side, limits.sole_half[index])[:, :, 2] < TOUCHES).any(axis=1))
        wrong.append(touches != (log.element("estimator_status", f"{side}_loaded") > 0.0))
    return float(np.mean(wrong))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
