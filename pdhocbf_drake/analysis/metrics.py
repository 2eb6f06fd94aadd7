"""The numbers of `metrics.json`, computed from the log."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.analysis.barrier_margins import (
    BarrierUse,
    barriers_of,
    bound_along,
    h_along,
    psi_along_log,
    violated,
)
from pdhocbf_drake.analysis.estimate import estimator_metrics
from pdhocbf_drake.analysis.feet import gap_min, slip_max, stance_width, steps_taken, zmp_margins
from pdhocbf_drake.analysis.ground_use import friction_used, yaw_moment_used
from pdhocbf_drake.analysis.heading import along, along_heading, commanded_path, settled_errors, zmp_seen
from pdhocbf_drake.analysis.heights import commanded_com_height
from pdhocbf_drake.analysis.metrics_schema import BarrierMetrics, BoundMetrics, Metrics, MpcMetrics, WholeBodyMetrics
from pdhocbf_drake.analysis.plan_limits import at_plan_limits
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.barriers.margin import BarrierRecord, record_from_h
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.plan import NOTICED, Reason
from pdhocbf_drake.simulation.commands import commanded_gait, known_ground
from pdhocbf_drake.simulation.run_log import FELL, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.kernels import LEAST_LOAD
from pdhocbf_drake.systems.signals import JOINTS
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.support import contains
from pdhocbf_drake.walking.waypoints import distance_to
from pdhocbf_drake.whole_body.reason import Reason as WholeBodyReason

Array = NDArray[np.float64]

_NOWHERE: dict[str, Any] = dict.fromkeys(
    ("distance", "distance_commanded", "mean_speed", "lateral_drift", "yaw_drift_deg")
)
_ROUNDING = 1e-9  # [m]: a template keeps its box to that
_AT_LIMIT = 1.0 - 1e-9  # share of a torque's limit from which on it counts as reached
# Reasons for which the first solver found no optimum of the problem that the scenario states.
_FAILED = (Reason.CROSS_SOLVED, Reason.RELAXED, Reason.INFEASIBLE, Reason.NOT_OPTIMAL, Reason.NO_STEADY_PLAN)


def compute_metrics(scenario: Scenario, log: RunLog, wall_seconds: float, limits: RobotLimits | None) -> Metrics:
    """The metrics of a run; `limits` are the robot's, None on a template."""
    simulated = float(log.time[-1] - log.time[0]) if len(log) else 0.0
    walks = "lip_state" in log and len(log) > 0
    body = limits if "robot_state" in log and len(log) > 0 else None
    path = _along_path(scenario, log, body) if walks else dict(_NOWHERE)
    return Metrics(
        scenario=scenario.name,
        template=scenario.system != "biped",
        ending=log.ending,
        fell=log.ending == FELL,
        simulated_seconds=simulated,
        wall_seconds=wall_seconds,
        real_time_factor=simulated / wall_seconds if wall_seconds > 0 else None,
        steps_taken=steps_taken(log, scenario.gait.swing_height) if walks else None,
        **path,
        left_path=None if body is None else _left_path(path["lateral_drift"], body),
        stance_width=stance_width(log.after(scenario.from_time)) if walks else None,
        stance_width_commanded=scenario.gait.stance_width if walks else None,
        com_rms_error=_com_rms_error(log) if walks else None,
        zmp_margin_min=_finite(zmp_margins(log, body.sole_half, scenario.terrain).min()) if body else None,
        unloaded_ticks=_unloaded_ticks(log, body.weight) if body else None,
        zmp_outside_fraction=_zmp_outside(log) if walks else None,
        slip_max=_finite(slip_max(log)) if body else None,
        sole_gap_min=_finite(gap_min(log, body.sole_half)) if body else None,
        joint_torque_peak=_finite(np.abs(log["actuation"]).max()) if body else None,
        torque_limit_hits=int((np.abs(log["actuation"]) >= _AT_LIMIT * body.effort).sum()) if body else None,
        torque_peaks=dict(zip(JOINTS, map(_finite, np.abs(log["actuation"]).max(axis=0)), strict=True))
        if body
        else None,
        torque_margin_min=_torque_margin(log, body) if body else None,
        friction_used_max=_of_ground(friction_used, log, body),
        yaw_moment_used_max=_of_ground(yaw_moment_used, log, body),
        joint_position_margin_min=_position_margin(log, body) if body else None,
        joint_speed_margin_min=_finite((body.speed - np.abs(log["joint_state"][:, 12:])).min()) if body else None,
        barriers=_barrier_metrics(scenario, log),
        mpc=_mpc_metrics(scenario, log),
        estimator=None if body is None else estimator_metrics(log, body, scenario.gait.ticks_per_gait),
        whole_body=_whole_body_metrics(log),
        plan_limits=_plan_limits(scenario, log) if body else None,
    )


def _left_path(drift: float | None, body: RobotLimits) -> bool | None:
    return None if drift is None else bool(drift > 2.0 * body.sole_half[:, 1].min())


def torso_yaw(log: RunLog, ahead: ArrayLike) -> Array:
    """Heading of the torso, whose x axis has these components in the floating base, without jumps, (T,) [rad]."""
    w, x, y, z = log["robot_state"][:, :4].T
    a, b, c = np.asarray(ahead, dtype=float)
    x_of_torso = (1.0 - 2.0 * (y * y + z * z)) * a + 2.0 * (x * y - w * z) * b + 2.0 * (x * z + w * y) * c
    y_of_torso = 2.0 * (w * z + x * y) * a + (1.0 - 2.0 * (x * x + z * z)) * b + 2.0 * (y * z - w * x) * c
    return np.unwrap(np.arctan2(y_of_torso, x_of_torso))


def _along_path(scenario: Scenario, log: RunLog, body: RobotLimits | None) -> dict[str, Any]:
    """What is counted along and across the path that is commanded, which is x without commands."""
    yaw = torso_yaw(log, body.ahead) if body else None
    com = log["lip_state"][:, [0, 3]]
    found: dict[str, Any] = {
        "position": [_finite(value) for value in com[-1]],
        "heading_deg": None if yaw is None else _finite(np.degrees(yaw[-1])),
    }
    later = log.after(scenario.from_time)
    if yaw is not None and len(later) > 1:
        first = len(log) - len(later)
        found["turn_rate"] = _finite((yaw[-1] - yaw[first]) / (log.time[-1] - log.time[first]))
    if "path" not in log:
        return found | {
            "distance": _finite(np.diff(com[[0, -1], 0]).item()),
            "distance_commanded": _distance_commanded(scenario, log),
            "mean_speed": _statistic(np.mean, later.element("lip_state", "vx")),
            "lateral_drift": _drift(scenario, log, com[:, 1]),
            "yaw_drift_deg": None if yaw is None else _drift(scenario, log, np.degrees(yaw)),
        }
    gait = scenario.gait
    path = commanded_path(log, gait.ticks_per_step, gait.tick)
    joined = commanded_path(log, gait.ticks_per_step, gait.tick, joined=True)
    heading, way, away = path[1:, 2], np.diff(joined[:, :2], axis=0), com - path[:, :2]
    error = np.full((len(log), 2), np.nan)
    if len(log) >= gait.ticks_per_gait:
        window = np.full(gait.ticks_per_gait, 1.0 / gait.ticks_per_gait)
        error = np.column_stack([np.convolve(column, window, mode="valid") for column in away.T])
    speeds = along(log["lip_state"][:, [1, 4]], path[:, 2])[len(log) - len(later) :, 0]
    settled = settled_errors(log, yaw, gait.ticks_per_step)
    return found | {
        "distance": _finite(along(np.diff(com, axis=0), heading)[:, 0].sum()),
        "distance_commanded": _finite(along(way, heading)[:, 0].sum()),
        "mean_speed": _statistic(np.mean, speeds),
        "lateral_drift": _drift(scenario, log, along(away, path[:, 2])[:, 1]),
        "yaw_drift_deg": None if yaw is None else _drift(scenario, log, np.degrees(yaw - path[:, 2])),
        "path_error_max": _finite(_path_errors(scenario, com, error).max()),
        "command_error": None if settled is None else [_finite(value) for value in settled],
        "commands_limited": _limited(log),
    }


def _limited(log: RunLog) -> int | None:
    """How many of the commands that were taken up were granted in part; each change counts as another command."""
    if "command_asked" not in log:
        return None
    asked, granted = log["command_asked"], log["path"][:, 3:]
    limited, changed = np.any(granted != asked, axis=1), np.any(np.diff(asked, axis=0, prepend=np.nan) != 0.0, axis=1)
    return int(np.count_nonzero(limited & changed))


def _path_errors(scenario: Scenario, com: Array, away: Array) -> Array:
    """Distance of the CoM's mean over each gait from the waypoints' lines, or without any from the commanded path."""
    if not scenario.path or np.isnan(away).any():
        return np.asarray(np.linalg.norm(away, axis=1))
    window = np.full(scenario.gait.ticks_per_gait, 1.0 / scenario.gait.ticks_per_gait)
    mean = np.column_stack([np.convolve(column, window, mode="valid") for column in com.T])
    return distance_to([scenario.start.position, *scenario.path], mean)


def _drift(scenario: Scenario, log: RunLog, values: Array) -> float | None:
    """Distance of the mean over the last gait, which removes the gait's sway, from the start; None without a gait."""
    if steps_taken(log, scenario.gait.swing_height) < 2:
        return None
    return _finite(abs(values[-scenario.gait.ticks_per_gait :].mean() - values[0]))


def _distance_commanded(scenario: Scenario, log: RunLog) -> float:
    """At the end of n whole steps the feet are n and n − 1 strides ahead, and the CoM is between them."""
    gait = scenario.gait
    step, tick = log["gait_phase"][-1, 1], log["gait_phase"][-1, 0]
    walked = float(step + tick / gait.ticks_per_step - gait.start_steps)
    if known_ground(scenario) is not None:
        return _middle(commanded_gait(scenario), int(step), float(tick / gait.ticks_per_step))
    if gait.walk_steps is not None and walked >= gait.walk_steps:
        return max(0, gait.walk_steps - 1) * gait.stride
    return max(0.0, walked - 0.5) * gait.stride


def _middle(gait: Gait, step: int, share: float) -> float:
    """x of the middle between the feet, a share into a step, from that at the start [m]."""
    last, here, coming = (gait.step(j).x for j in (step - 1, step, step + 1))
    return 0.5 * ((1.0 - share) * (last + here) + share * (here + coming)) - gait.step(-1).x


def _com_rms_error(log: RunLog) -> list[float | None]:
    errors = [log.element("lip_state", axis) - log.element("com_reference", axis) for axis in "xy"]
    rms = [_finite(np.sqrt(np.mean(error**2))) for error in errors]
    if "com_z" not in log:
        return [*rms, None]
    height = log.element("com_z", "z") - commanded_com_height(log)
    return [*rms, _finite(np.sqrt(np.mean(height**2)))]


def _zmp_outside(log: RunLog) -> float:
    return float(1.0 - contains(log["zmp_box"].reshape(-1, 2, 2), zmp_seen(log), _ROUNDING).mean())


def _unloaded_ticks(log: RunLog, weight: float) -> int | None:
    """The start is no such tick: contact is found from the first step of the plant on; None in older logs."""
    return int((log["ground_load"][1:] <= LEAST_LOAD * weight).sum()) if "ground_load" in log else None


def _torque_margin(log: RunLog, limits: RobotLimits) -> float | None:
    """Of the feedforward, which may ask for more than there is, and of what is applied, which can't be more."""
    asked = np.maximum(np.abs(log["actuation"]), np.abs(log["feedforward"]))
    return _finite((limits.effort - asked).min())


def _of_ground(used: Callable[[RunLog, RobotLimits], Array], log: RunLog, body: RobotLimits | None) -> float | None:
    """The largest of what is used of the ground; None in older logs."""
    return _finite(used(log, body).max()) if body is not None and "contact_forces" in log else None


def _position_margin(log: RunLog, limits: RobotLimits) -> float | None:
    angles, (lowest, highest) = log["joint_state"][:, :12], limits.position.T
    return _finite(np.minimum(angles - lowest, highest - angles).min())


def _barrier_metrics(scenario: Scenario, log: RunLog) -> dict[str, BarrierMetrics]:
    table = {}
    for name, use in barriers_of(scenario).items():
        rows = log.after(scenario.from_time)
        judged = h_along(rows, scenario, use)
        judged = judged[~np.isnan(judged)] if use.changed else judged
        bound = bound_along(log, scenario, use) if "barrier_bound" in log else judged  # the oscillator's is not logged
        magnitude = np.abs(np.nan_to_num([*bound, *judged])).max(initial=0.0)
        slack = log["barrier_slack"][:, use.column] if "barrier_slack" in log else None  # older logs have none
        try:
            record = record_from_h(judged, use.class_k)
        except InputError:  # there is no such row, or one with NaN
            record = None
        table[name] = BarrierMetrics(
            h_min=record.h_min if record else None,
            h_mean=record.h_mean if record else None,
            violations=int(violated(judged, magnitude).sum()) if len(judged) else None,
            psi_min=_psi_min(rows, use, record) if record else None,
            slack_max=_statistic(np.max, slack) if slack is not None else None,
            softened_ticks=int((slack > NOTICED).sum()) if slack is not None else None,
            **_action(scenario, log, use.column),
            gamma=list(use.gamma),
            relative_degree=use.relative_degree,
            unit=use.unit,
        )
    return table


def _psi_min(rows: RunLog, use: BarrierUse, record: BarrierRecord) -> float | None:
    if not (use.seen_anew or use.changed):
        return _finite(record.psi_min)
    psi = psi_along_log(rows, use)
    return _statistic(np.min, psi[np.isfinite(psi)])


def _action(scenario: Scenario, log: RunLog, column: int) -> dict[str, Any]:
    """Ticks whose plan a barrier changed, and the walk's speed over the steps in which they are."""
    if "barrier_active" not in log:  # an older log
        return {}
    acted = log["barrier_active"][1:, column] > 0.0  # a row holds what was planned at the row before
    found = _when(log.time[:-1], acted)
    if "lip_state" not in log or not acted.any():
        return found
    gait, step = scenario.gait, log.element("gait_phase", "step")[:-1]
    whole = (step < step[-1]) & (log.element("gait_phase", "support")[:-1] != 0.0)
    rows = whole & np.isin(step, step[acted])
    if "path" in log:
        wanted = log.element("path", "forward")[:-1][rows]
        ahead = along_heading(log, "lip_state", 1, 4)[:-1, 0][rows]
        slower = np.sign(wanted) * (wanted - ahead)
        return {**found, "active_slower": _statistic(np.mean, slower)}
    commanded = abs(gait.stride) / (gait.ticks_per_step * gait.tick)
    forward = np.copysign(1.0, gait.stride) * log.element("lip_state", "vx")[:-1][rows]
    return {**found, "active_slower": _statistic(lambda speeds: commanded - np.mean(speeds), forward)}


def _when(time: Array, active: NDArray[np.bool_]) -> dict[str, Any]:
    """At how many ticks something was active, and when first [s]."""
    return {"active_ticks": int(active.sum()), "active_first": float(time[active][0]) if active.any() else None}


def _plan_limits(scenario: Scenario, log: RunLog) -> dict[str, BoundMetrics] | None:
    at = at_plan_limits(scenario, log)
    return {name: BoundMetrics(**_when(log.time, active)) for name, active in at.items()} or None


def _mpc_metrics(scenario: Scenario, log: RunLog) -> MpcMetrics | None:
    if "solver_status" not in log:
        return None
    # The first row holds the start, which is no solve's result.
    status, seconds, _, slack, fallbacks, reasons = log["solver_status"][1:].T
    failed = (status != 1.0) | np.isin(reasons, _FAILED)
    if scenario.mpc.barrier == "hard" and scenario.system != "van_der_pol":
        # The slack of a soft barrier is part of the scenario's problem; a hard one has none.
        failed |= (reasons == Reason.SOFTENED) | (slack > NOTICED)
    return MpcMetrics(
        solves=len(status),
        fallbacks=int((fallbacks > 0).sum()),
        failures=int(failed.sum()),
        degraded={r.name.lower(): int(n) for r in Reason if r != Reason.SOLVED and (n := (reasons == r).sum())},
        slack_max=_statistic(np.max, slack),
        tick_seconds_median=_statistic(np.median, seconds),
        tick_seconds_p99=_statistic(lambda values: np.percentile(values, 99), seconds),
        # The oscillator's filter is `BarrierFilter`, which projects onto its rows.
        solver="projection" if scenario.system == "van_der_pol" else scenario.mpc.solver,
    )


def _whole_body_metrics(log: RunLog) -> WholeBodyMetrics | None:
    if "whole_body" not in log:
        return None
    reasons = log.element("whole_body", "reason")
    misses = {
        r.name.lower(): int(n) for r in WholeBodyReason if r > WholeBodyReason.KEPT and (n := (reasons == r).sum())
    }
    return WholeBodyMetrics(active_ticks=int((reasons != WholeBodyReason.INSIDE).sum()), misses=misses)


def _statistic(function: Callable[[Array], Any], values: Array) -> float | None:
    """The function of the values; None where there are none, or where it is not finite."""
    return _finite(function(values)) if len(values) else None


def _finite(value: float | np.floating) -> float | None:
    """The value; None, which JSON writes as null, for NaN or infinity."""
    return float(value) if np.isfinite(value) else None
