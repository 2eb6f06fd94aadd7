"""A walk's log along its commanded path: the path itself, and signals as the stance foot sees them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.simulation.run_log import RunLog

Array = NDArray[np.float64]

SETTLING = 4  # steps after a change of the command that are not judged


def commanded_path(log: RunLog, ticks_per_step: int, tick: float, joined: bool = False) -> Array:
    """Where the CoM is commanded to be on average at each row, and the heading there, (T, 3) [m, rad].

    The middle between the feet of step j and its heading are those of the CoM half a step after the step's start;
    in between both change at a constant rate. The path of a walk that was pushed may begin anew within a step, where
    the robot is then; `joined` leaves these jumps out.
    """
    step = log.element("gait_phase", "step")
    starts = np.flatnonzero(np.diff(step, prepend=step[0] - 1.0))
    path = log["path"]
    nodes, last = path[starts, :3], path[-1]
    c, s = np.cos(last[2]), np.sin(last[2])
    way = ticks_per_step * tick * np.array([c * last[3] - s * last[4], s * last[3] + c * last[4], last[5]])
    places = np.append(step[starts], step[-1] + 1.0) + 0.5
    nodes = np.vstack([nodes, nodes[-1] + way])
    if joined:
        ends = np.append(starts[1:], len(path)) - 1
        nodes[1:, :2] -= np.cumsum(path[ends, :2] - path[starts, :2], axis=0)
    now = step + log.element("gait_phase", "tick") / ticks_per_step
    return np.column_stack([np.interp(now, places, column) for column in nodes.T])


def along(vectors: Array, yaw: Array) -> Array:
    """Vectors (T, 2) of the world as seen along headings (T,) [rad]."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.column_stack([c * vectors[:, 0] + s * vectors[:, 1], c * vectors[:, 1] - s * vectors[:, 0]])


def box_frame(log: RunLog) -> Array:
    """Place and heading of the frame in which the log's ZMP box is, (T, 3) [m, rad]: those of the tick before."""
    path = log["path"][:, :3]
    return np.vstack([path[:1], path[:-1]])


def zmp_seen(log: RunLog) -> Array:
    """The measured ZMP along the axes of the log's ZMP box, (T, 2) [m]."""
    zmp = np.stack([log.element("lip_state", f"{axis}_zmp") for axis in "xy"], axis=1)
    return along(zmp, box_frame(log)[:, 2]) if "path" in log else zmp


def seen_from_path(log: RunLog) -> RunLog:
    """A log whose CoM, ZMP and ZMP box are seen from the commanded path, along its heading; others as they are."""
    if "path" not in log:
        return log
    frame = box_frame(log)
    origin, yaw = along(frame[:, :2], frame[:, 2]), frame[:, 2]
    signals = dict(log.signals)
    for name, places in (("lip_state", (0, 3)), ("com_reference", (0, 3)), ("zmp_reference", (0, 2))):
        table, (x, y) = log[name].copy(), places
        for i in range(y - x):
            table[:, [x + i, y + i]] = along(log[name][:, [x + i, y + i]], yaw)
        signals[name] = table
    lip, com, zmp = (signals[name] for name in ("lip_state", "com_reference", "zmp_reference"))
    for table, columns in ((lip, [0, 3]), (lip, [2, 5]), (com, [0, 3]), (zmp, [0, 2])):
        table[:, columns] -= origin
    signals["zmp_box"] = log["zmp_box"] - np.repeat(origin, 2, axis=1)
    return RunLog(signals, log.time, log.ending)


def along_heading(log: RunLog, name: str, x: int, y: int) -> Array:
    """Columns x and y of a signal along the heading of the stance foot, (T, 2)."""
    return along(log[name][:, [x, y]], log["path"][:, 2]) if "path" in log else log[name][:, [x, y]]


def settled_errors(log: RunLog, yaw: Array | None, ticks_per_step: int) -> Array | None:
    """The largest errors of velocity ahead and aside [m/s] and of the turn rate [rad/s], over whole gaits, (3,).

    Each command is judged from four steps after its beginning on. None where no gait is; without `yaw` the turn rate
    is NaN.

    Args:
        yaw: of the body, without jumps (T,) [rad].
    """
    path, gait = log["path"], 2 * ticks_per_step
    heading = commanded_path(log, ticks_per_step, np.diff(log.time[:2]).item())[:, 2]
    velocity = along(log["lip_state"][:, [1, 4]], heading)
    edges = np.flatnonzero(np.any(np.diff(path[:, 3:], axis=0) != 0.0, axis=1)) + 1
    worst = None
    for start, stop in zip([0, *edges], [*edges, len(path)], strict=True):
        first = start + SETTLING * ticks_per_step
        whole = (stop - first) // gait * gait
        if path[start, 6] == 0.0 or whole <= 0:
            continue
        rows = slice(first, first + whole)
        turned = np.nan if yaw is None else np.diff(yaw[rows][[0, -1]]).item() / np.ptp(log.time[rows])
        error = np.abs(np.append(velocity[rows].mean(axis=0), turned) - path[start, 3:6])
        worst = error if worst is None else np.maximum(worst, error)
    return worst
