"""Distance, speed, drift and heading of a walk, along and across the path that is commanded."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pdhocbf_drake.analysis.feet import steps_taken
from pdhocbf_drake.analysis.finite import Array, finite, statistic
from pdhocbf_drake.analysis.heading import along, commanded_path, settled_errors
from pdhocbf_drake.analysis.metrics_schema import GrantedCommand
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.simulation.commands import commanded_gait, known_ground
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.waypoints import distance_to

_COMMANDS = 20  # that are named of those granted in part


def torso_yaw(log: RunLog, ahead: ArrayLike) -> Array:
    """Heading of the torso, whose x axis has these components in the floating base, without jumps, (T,) [rad]."""
    w, x, y, z = log["robot_state"][:, :4].T
    a, b, c = np.asarray(ahead, dtype=float)
    x_of_torso = (1.0 - 2.0 * (y * y + z * z)) * a + 2.0 * (x * y - w * z) * b + 2.0 * (x * z + w * y) * c
    y_of_torso = 2.0 * (w * z + x * y) * a + (1.0 - 2.0 * (x * x + z * z)) * b + 2.0 * (y * z - w * x) * c
    return np.unwrap(np.arctan2(y_of_torso, x_of_torso))


def path_metrics(scenario: Scenario, log: RunLog, body: RobotLimits | None) -> dict[str, Any]:
    """What is counted along and across the path that is commanded, which is x without commands."""
    yaw = torso_yaw(log, body.ahead) if body else None
    com = log["lip_state"][:, [0, 3]]
    found: dict[str, Any] = {
        "position": [finite(value) for value in com[-1]],
        "heading_deg": None if yaw is None else finite(np.degrees(yaw[-1])),
    }
    later = log.after(scenario.from_time)
    if yaw is not None and len(later) > 1:
        first = len(log) - len(later)
        found["turn_rate"] = finite((yaw[-1] - yaw[first]) / (log.time[-1] - log.time[first]))
    if "path" not in log:
        return found | {
            "distance": finite(np.diff(com[[0, -1], 0]).item()),
            "distance_commanded": _distance_commanded(scenario, log),
            "mean_speed": statistic(np.mean, later.element("lip_state", "vx")),
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
        "distance": finite(along(np.diff(com, axis=0), heading)[:, 0].sum()),
        "distance_commanded": finite(along(way, heading)[:, 0].sum()),
        "mean_speed": statistic(np.mean, speeds),
        "lateral_drift": _drift(scenario, log, along(away, path[:, 2])[:, 1]),
        "yaw_drift_deg": None if yaw is None else _drift(scenario, log, np.degrees(yaw - path[:, 2])),
        "path_error_max": finite(_path_errors(scenario, com, error).max()),
        "command_error": None if settled is None else [finite(value) for value in settled],
        **_limited(log),
    }


def _limited(log: RunLog) -> dict[str, Any]:
    """The commands that were taken up and granted in part; each change counts as another command."""
    if "command_asked" not in log:
        return {}
    asked, granted = log["command_asked"], log["path"][:, 3:]
    limited, changed = np.any(granted != asked, axis=1), np.any(np.diff(asked, axis=0, prepend=np.nan) != 0.0, axis=1)
    rows = np.flatnonzero(limited & changed)
    first = [
        GrantedCommand(time=log.time[k], asked=tuple(asked[k, :3]), granted=tuple(granted[k, :3]))
        for k in rows[:_COMMANDS]
    ]
    return {"commands_limited": len(rows), "commands_granted": tuple(first)}


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
    return finite(abs(values[-scenario.gait.ticks_per_gait :].mean() - values[0]))


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
