"""Motion of the soles in a log: steps taken, slip, touchdowns, and the distance of the ZMP from the support's edge."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry.optimization import HPolyhedron, VPolytope

from pdhocbf_drake.simulation.run_log import RunLog

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_ON_GROUND = 1e-3  # [m]: a lower sole stands on the ground, into which soles sink by some tenths of a millimetre
_LIFTED = 5e-3  # [m]: a swing foot that never rose this far took no step

_SUPPORT = {"left": 1.0, "right": -1.0}


def stands(log: RunLog, side: str) -> Mask:
    """Rows in which the gait has this foot on the ground for the whole step, (T,)."""
    support = log.element("gait_phase", "support")
    return (support == _SUPPORT[side]) | (support == 0.0)


def steps_taken(log: RunLog) -> int:
    """Steps of one foot that are complete in the log; on a robot, those whose foot left the ground."""
    step, support = log.element("gait_phase", "step"), log.element("gait_phase", "support")
    count = 0
    for index in np.unique(step[support != 0.0]):
        rows = step == index
        if index == step[-1]:  # only the next row would show that it is complete
            continue
        swing = "right" if support[rows][0] > 0 else "left"
        if "foot_state" not in log or log.element("foot_state", f"{swing}_z")[rows].max() > _LIFTED:
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


def zmp_margins(log: RunLog, sole_half: Array) -> Array:
    """Distance of the measured ZMP from the edge of the support polygon, negative outside it, (T,) [m].

    The polygon is the convex hull of the soles on which the gait stands, and of any other within a millimetre of the
    ground.
    """
    zmp = np.stack([log.element("lip_state", "x_zmp"), log.element("lip_state", "y_zmp")], axis=1)
    on_ground = {side: stands(log, side) | (log.element("foot_state", f"{side}_z") < _ON_GROUND) for side in _SUPPORT}
    corners = {side: sole_corners(log, side, sole_half[i]) for i, side in enumerate(_SUPPORT)}
    margins = np.empty(len(log))
    for row in range(len(log)):
        carrying = [corners[side][row] for side in _SUPPORT if on_ground[side][row]]
        margins[row] = _margin(zmp[row], np.concatenate(carrying)) if np.isfinite(zmp[row]).all() else np.nan
    return margins


def sole_corners(log: RunLog, side: str, half: Array) -> Array:
    """The four corners of a sole on the ground, counter-clockwise, (T, 4, 2) [m]."""
    yaw = log.element("foot_state", f"{side}_yaw")
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.stack([np.stack([cos, -sin], axis=1), np.stack([sin, cos], axis=1)], axis=1)
    local = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half
    corners: Array = sole_centres(log, side)[:, None, :] + np.einsum("tij,cj->tci", turn, local)
    return corners


def _margin(point: Array, corners: Array) -> float:
    """Signed distance to the edges' lines of the corners' hull: exact inside, a lower bound of the distance outside."""
    hull = HPolyhedron(VPolytope(corners.T))
    normals = hull.A()
    return float(((hull.b() - normals @ point) / np.linalg.norm(normals, axis=1)).min())


def _stretches(mask: Mask) -> list[slice]:
    """The maximal stretches of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [slice(int(start), int(stop)) for start, stop in zip(edges[::2], edges[1::2], strict=True)]
