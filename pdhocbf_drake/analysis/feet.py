"""What the soles did: steps taken, slip, and how far the ZMP stayed from the edge of the support."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry.optimization import HPolyhedron, VPolytope

from pdhocbf_drake.simulation.run_log import RunLog

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# A sole that is less than this above the ground stands on it; soles sink in by some tenths of a millimetre.
_ON_GROUND = 1e-3  # [m]
# A swing foot that never rose this far did not take a step.
_LIFTED = 5e-3  # [m]

_SUPPORT = {"left": 1.0, "right": -1.0}


def stands(log: RunLog, side: str) -> Mask:
    """Rows in which the gait has this foot on the ground for the whole step, (T,)."""
    support = log.element("gait_phase", "support")
    return (support == _SUPPORT[side]) | (support == 0.0)


def steps_taken(log: RunLog) -> int:
    """Steps of one foot that the log holds to their end; on a robot, those whose foot did leave the ground."""
    step, support = log.element("gait_phase", "step"), log.element("gait_phase", "support")
    count = 0
    for index in np.unique(step[support != 0.0]):
        rows = step == index
        if index == step[-1]:  # perhaps not at its end, and the next row would tell
            continue
        swing = "right" if support[rows][0] > 0 else "left"
        if "foot_state" not in log or log.element("foot_state", f"{swing}_z")[rows].max() > _LIFTED:
            count += 1
    return count


def slip_max(log: RunLog) -> float:
    """The farthest that a sole's centre moved along the ground while it stood [m]."""
    farthest = 0.0
    for side in _SUPPORT:
        place = np.stack([log.element("foot_state", f"{side}_{axis}") for axis in "xy"], axis=1)
        for rows in _runs(stands(log, side)):
            stance = place[rows]
            farthest = max(farthest, float(np.linalg.norm(stance - stance[0], axis=1).max()))
    return farthest


def touchdown_rows(log: RunLog, side: str) -> list[int]:
    """The first row of each stance of a foot; after half a step, when it has settled, where the log is that long."""
    settle = int(log.element("gait_phase", "tick").max() // 2)
    return [min(rows.start + settle, rows.stop - 1) for rows in _runs(stands(log, side))]


def zmp_margins(log: RunLog, sole_half: Array) -> Array:
    """Distance of the measured ZMP from the edge of the support polygon, negative outside it, (T,) [m].

    The polygon is the convex hull of the soles that carry: those on which the gait stands, and any other within a
    millimetre of the ground.
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
    centre = np.stack([log.element("foot_state", f"{side}_{axis}") for axis in "xy"], axis=1)
    yaw = log.element("foot_state", f"{side}_yaw")
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.stack([np.stack([cos, -sin], axis=1), np.stack([sin, cos], axis=1)], axis=1)
    local = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half
    corners: Array = centre[:, None, :] + np.einsum("tij,cj->tci", turn, local)
    return corners


def _margin(point: Array, corners: Array) -> float:
    """Signed distance to the edges' lines of the corners' hull: exact inside, a lower bound of the distance outside."""
    hull = HPolyhedron(VPolytope(corners.T))
    normals = hull.A()
    return float(((hull.b() - normals @ point) / np.linalg.norm(normals, axis=1)).min())


def _runs(mask: Mask) -> list[slice]:
    """The maximal stretches of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [slice(int(start), int(stop)) for start, stop in zip(edges[::2], edges[1::2], strict=True)]
