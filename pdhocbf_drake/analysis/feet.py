"""Motion of the soles in a log: steps taken, slip, touchdowns, and the distance of the ZMP from the support's edge."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis.heading import along
from pdhocbf_drake.analysis.heights import above_ground
from pdhocbf_drake.ground.terrain import Terrain
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.walking.sole_gap import sole_gaps

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

TOUCHES = 1e-5  # [m]: a lower corner of a sole touches the ground, into which what carries load sinks
_LIFTED = 0.1  # share of the swing height: a swing foot that never rose this far took no step

_SUPPORT = {"left": 1.0, "right": -1.0}


def stands(log: RunLog, side: str) -> Mask:
    """Rows in which the gait has this foot on the ground for the whole step, (T,)."""
    support = log.element("gait_phase", "support")
    return (support == _SUPPORT[side]) | (support == 0.0)


def steps_taken(log: RunLog, swing_height: float) -> int:
    """Steps of one foot that are complete in the log; on a robot, those whose foot left the ground."""
    least = _LIFTED * swing_height
    step, support = log.element("gait_phase", "step"), log.element("gait_phase", "support")
    count = 0
    for index in np.unique(step[support != 0.0]):
        rows = step == index
        if index == step[-1]:  # only the next row would show that it is complete
            continue
        swing = "right" if support[rows][-1] > 0 else "left"  # a step in place of a stand may begin later
        height = log.element("foot_state", f"{swing}_z")[rows] if "foot_state" in log else None
        if height is None or height.max() - height[0] > least:
            count += 1
    return count


def slip_max(log: RunLog) -> float:
    """The farthest that a sole's centre moved along the ground from where its stance began [m]."""
    farthest = 0.0
    for side in _SUPPORT:
        centre = sole_centres(log, side)
        for rows in _stretches(stands(log, side)):
            stance = centre[rows]
            farthest = max(farthest, float(np.linalg.norm(stance - stance[0], axis=1).max()))
    return farthest


def stance_width(log: RunLog) -> float | None:
    """Mean lateral distance of the stance from the one before it, over the steps of a walk [m]; None without two.

    Footholds are a compromise of the commanded ones with the effort, so that a walk is narrower than its command.
    """
    support, step = log.element("gait_phase", "support"), log.element("gait_phase", "step")
    rows = [row for row in step_starts(log)[2:] if support[row] * support[row - 1] < 0.0 and step[row] > 0.0]
    if not rows:
        return None
    ways = log["stance_plan"][rows][:, 2:4] - log["stance_plan"][rows][:, :2]
    if "path" in log:
        ways = along(ways, 0.5 * (log["path"][rows, 2] + log["path"][[row - 1 for row in rows], 2]))
    return float(np.abs(ways[:, 1]).mean())


def gap_min(log: RunLog, sole_half: Array) -> float:
    """The least distance of the soles, seen from above, negative where they overlap [m]."""
    left, right = (np.column_stack([sole_centres(log, s), log.element("foot_state", f"{s}_yaw")]) for s in _SUPPORT)
    return float(sole_gaps(left, right, np.min(sole_half, axis=0)).min())


def sole_centres(log: RunLog, side: str) -> Array:
    """x and y of a sole's centre, (T, 2) [m]."""
    return np.stack([log.element("foot_state", f"{side}_{axis}") for axis in "xy"], axis=1)


def step_starts(log: RunLog) -> list[int]:
    """The first row of each step."""
    return np.flatnonzero(np.diff(log.element("gait_phase", "step"), prepend=-1.0)).tolist()


def touchdown_rows(log: RunLog, side: str) -> list[int]:
    """A row of each stance of a foot: half a step after its start, when the foot has settled, or the stance's last."""
    settle = int(log.element("gait_phase", "tick").max() // 2)
    return [min(rows.start + settle, rows.stop - 1) for rows in _stretches(stands(log, side))]


def zmp_margins(log: RunLog, sole_half: Array, terrain: Terrain | None = None) -> Array:
    """Distance of the measured ZMP from the edge of the support polygon, negative outside it, (T,) [m].

    The polygon is the convex hull of the corners of both soles that touch the ground. Where none does, the margin is
    infinite; where the ZMP is no number, NaN. The ground is that of the terrain, or else flat.
    """
    zmp = np.stack([log.element("lip_state", "x_zmp"), log.element("lip_state", "y_zmp")], axis=1)
    corners = np.concatenate([sole_corners(log, side, sole_half[i]) for i, side in enumerate(_SUPPORT)], axis=1)
    return hull_margins(zmp, corners[:, :, :2], above_ground(corners, terrain) < TOUCHES)


def sole_corners(log: RunLog, side: str, half: Array) -> Array:
    """The four corners of a sole in the world, counter-clockwise, (T, 4, 3) [m]."""
    roll, pitch, yaw = (log.element("foot_state", f"{side}_{angle}") for angle in ("roll", "pitch", "yaw"))
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(angle), np.sin(angle)) for angle in (roll, pitch, yaw))
    # The first two columns of R_z(yaw) R_y(pitch) R_x(roll), as in Drake's RollPitchYaw, (T, 3) each.
    ahead = np.stack([cy * cp, sy * cp, -sp], axis=1)
    across = np.stack([cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr], axis=1)
    centre = np.stack([log.element("foot_state", f"{side}_{axis}") for axis in "xyz"], axis=1)
    local = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half
    corners: Array = centre[:, None] + local[:, :1] * ahead[:, None] + local[:, 1:] * across[:, None]
    return corners


def hull_margins(points: Array, corners: Array, counted: Mask) -> Array:
    """Signed distance of points (T, 2) from the edge of the convex hull of those corners (T, n, 2) that count (T, n).

    It is min over unit vectors d of max_i d·corner_i − d·point, positive inside. The least one is that of an edge's
    normal, or outside that of the way from a corner to the point; so these are tried. Infinite where no corner counts.
    """
    margins = np.full(len(points), np.inf)
    ways = [(points - corners[:, i], counted[:, i]) for i in range(corners.shape[1])]
    for i, j in combinations(range(corners.shape[1]), 2):
        normal = (corners[:, j] - corners[:, i])[:, ::-1] * [1.0, -1.0]
        both = counted[:, i] & counted[:, j]
        ways += [(normal, both), (-normal, both)]
    for way, tried in ways:
        length = np.linalg.norm(way, axis=1)
        tried = tried & (length > 0.0)
        unit = way / np.where(length > 0.0, length, 1.0)[:, None]
        reach = np.where(counted, np.einsum("tij,tj->ti", corners, unit), -np.inf).max(axis=1)
        margins = np.where(tried, np.minimum(margins, reach - np.einsum("tj,tj->t", points, unit)), margins)
    margins = np.where(np.isinf(margins) & counted.any(axis=1), 0.0, margins)  # the point is the only corner
    return np.where(np.isfinite(points).all(axis=1), margins, np.nan)


def _stretches(mask: Mask) -> list[slice]:
    """The maximal stretches of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [slice(int(start), int(stop)) for start, stop in zip(edges[::2], edges[1::2], strict=True)]
