"""The numbers of `metrics.json`, computed from the log."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from pdhocbf_drake.analysis.barrier_metrics import barrier_metrics
from pdhocbf_drake.analysis.estimate import estimator_metrics
from pdhocbf_drake.analysis.feet import gap_min, slip_max, stance_width, steps_taken, zmp_margins
from pdhocbf_drake.analysis.finite import Array, active, finite, statistic
from pdhocbf_drake.analysis.ground_use import friction_used, yaw_moment_used
from pdhocbf_drake.analysis.ground_walked import ground_walked
from pdhocbf_drake.analysis.heading import zmp_seen
from pdhocbf_drake.analysis.heights import commanded_com_height
from pdhocbf_drake.analysis.metrics_schema import BoundMetrics, Metrics, MpcMetrics, WholeBodyMetrics
from pdhocbf_drake.analysis.path_metrics import path_metrics
from pdhocbf_drake.analysis.plan_frame import plan_over_stance
from pdhocbf_drake.analysis.plan_limits import at_plan_limits
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.analysis.titles import robot_of
from pdhocbf_drake.mpc.plan import NOTICED, Reason
from pdhocbf_drake.simulation.run_log import FELL, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.kernels import LEAST_LOAD
from pdhocbf_drake.systems.signals import JOINTS
from pdhocbf_drake.walking.support import contains
from pdhocbf_drake.whole_body.reason import Reason as WholeBodyReason

_NOWHERE: dict[str, Any] = dict.fromkeys(
    ("distance", "distance_commanded", "mean_speed", "lateral_drift", "yaw_drift_deg")
)
_ROUNDING = 1e-9  # [m]: a template keeps its box to that
_AT_LIMIT = 1.0 - 1e-9  # share of a torque's limit from which on it counts as reached
# Reasons for which the first solver found no optimum of the problem that the scenario states.
_FAILED = (Reason.CROSS_SOLVED, Reason.RELAXED, Reason.INFEASIBLE, Reason.NOT_OPTIMAL, Reason.NO_STEADY_PLAN)


def compute_metrics(scenario: Scenario, log: RunLog, wall_seconds: float, limits: RobotLimits | None) -> Metrics:
    """The metrics of a run; `limits` are the robot's, None on a template."""
    log = plan_over_stance(log)
    simulated = float(log.time[-1] - log.time[0]) if len(log) else 0.0
    walks = "lip_state" in log and len(log) > 0
    body = limits if "robot_state" in log and len(log) > 0 else None
    path = path_metrics(scenario, log, body) if walks else dict(_NOWHERE)
    at_limit = np.abs(log["actuation"]) >= _AT_LIMIT * body.effort if body else np.zeros((1, 1), dtype=bool)
    return Metrics(
        scenario=scenario.name,
        robot=robot_of(scenario),
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
        zmp_margin_min=finite(zmp_margins(log, body.sole_half, scenario.terrain).min()) if body else None,
        unloaded_ticks=_unloaded_ticks(log, body.weight) if body else None,
        zmp_outside_fraction=_zmp_outside(log) if walks else None,
        ground=ground_walked(scenario, log) if walks else None,
        slip_max=finite(slip_max(log)) if body else None,
        sole_gap_min=finite(gap_min(log, body.sole_half)) if body else None,
        joint_torque_peak=finite(np.abs(log["actuation"]).max()) if body else None,
        torque_limit_hits=int(at_limit.sum()) if body else None,
        torque_limit_fraction=float(at_limit.any(axis=1).mean()) if body else None,
        torque_peaks=dict(zip(JOINTS, map(finite, np.abs(log["actuation"]).max(axis=0)), strict=True))
        if body
        else None,
        torque_margin_min=_torque_margin(log, body) if body else None,
        friction_used_max=_of_ground(friction_used, log, body),
        yaw_moment_used_max=_of_ground(yaw_moment_used, log, body),
        joint_position_margin_min=_position_margin(log, body) if body else None,
        joint_speed_margin_min=finite((body.speed - np.abs(log["joint_state"][:, 12:])).min()) if body else None,
        barriers=barrier_metrics(scenario, log),
        mpc=_mpc_metrics(scenario, log),
        estimator=None if body is None else estimator_metrics(log, body, scenario.gait.ticks_per_gait),
        whole_body=_whole_body_metrics(log),
        plan_limits=_plan_limits(scenario, log) if body else None,
    )


def _left_path(drift: float | None, body: RobotLimits) -> bool | None:
    return None if drift is None else bool(drift > 2.0 * body.sole_half[:, 1].min())


def _com_rms_error(log: RunLog) -> list[float | None]:
    errors = [log.element("lip_state", axis) - log.element("com_reference", axis) for axis in "xy"]
    rms = [finite(np.sqrt(np.mean(error**2))) for error in errors]
    if "com_z" not in log:
        return [*rms, None]
    height = log.element("com_z", "z") - commanded_com_height(log)
    return [*rms, finite(np.sqrt(np.mean(height**2)))]


def _zmp_outside(log: RunLog) -> float:
    return float(1.0 - contains(log["zmp_box"].reshape(-1, 2, 2), zmp_seen(log), _ROUNDING).mean())


def _unloaded_ticks(log: RunLog, weight: float) -> int | None:
    """The start is no such tick: contact is found from the first step of the plant on; None in older logs."""
    return int((log["ground_load"][1:] <= LEAST_LOAD * weight).sum()) if "ground_load" in log else None


def _torque_margin(log: RunLog, limits: RobotLimits) -> float | None:
    """Of what is sent, which may ask for more than there is, and of what is applied, which can't be more."""
    sent = log["feedforward"]
    if "torque_bias" in log:
        sent = sent + log["torque_bias"]
    asked = np.maximum(np.abs(log["actuation"]), np.abs(sent))
    return finite((limits.effort - asked).min())


def _of_ground(used: Callable[[RunLog, RobotLimits], Array], log: RunLog, body: RobotLimits | None) -> float | None:
    """The largest of what is used of the ground; None in older logs."""
    return finite(used(log, body).max()) if body is not None and "contact_forces" in log else None


def _position_margin(log: RunLog, limits: RobotLimits) -> float | None:
    angles, (lowest, highest) = log["joint_state"][:, :12], limits.position.T
    return finite(np.minimum(angles - lowest, highest - angles).min())


def _plan_limits(scenario: Scenario, log: RunLog) -> dict[str, BoundMetrics] | None:
    at = at_plan_limits(scenario, log)
    return {name: BoundMetrics(**active(log.time, acted)) for name, acted in at.items()} or None


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
        slack_max=statistic(np.max, slack),
        tick_seconds_median=statistic(np.median, seconds),
        tick_seconds_p99=statistic(lambda values: np.percentile(values, 99), seconds),
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
