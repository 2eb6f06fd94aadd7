"""The largest rectangle on the ground under a foot, with sides along x and y."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog, minimize_scalar
from scipy.spatial import ConvexHull, QhullError

from pdhocbf_drake.robot.foot_points import ground_layer


class Rectangle(NamedTuple):
    """A rectangle on the ground, in the frame of the foot's points.

    Attributes:
        centre: (3,) [m]. half_size: half length and half width (2,) [m].
    """

    centre: np.ndarray
    half_size: np.ndarray


def largest_rectangle(points: np.ndarray) -> Rectangle | None:
    """The rectangle of largest area in the convex hull of the lowest points; None where these have no area.

    With edges n·p ≤ d of the hull, centre c and half sides a, b:  maximize a b  with  n·c + |n_x| a + |n_y| b ≤ d.
    For a given a the largest b is a linear program, and a b has one maximum.

    Args:
        points: of a foot, z up (n, 3) [m].
    """
    layer = ground_layer(points) if len(points) else points
    try:
        edges = ConvexHull(layer[:, :2]).equations  # [n, −d]
    except (QhullError, ValueError):
        return None
    normals, offsets = edges[:, :2], -edges[:, 2]

    def widest(a: float) -> np.ndarray:
        """Centre and largest b for that a, (3,)."""
        rows = np.column_stack([normals, abs(normals[:, 1])])
        sides = [(None, None), (None, None), (0.0, None)]
        found = linprog([0.0, 0.0, -1.0], rows, offsets - abs(normals[:, 0]) * a, bounds=sides)
        return np.array(found.x) if found.success else np.zeros(3)

    longest = float(np.ptp(layer[:, 0])) / 2.0
    best = minimize_scalar(lambda a: -a * widest(a)[2], bounds=(0.0, longest), method="bounded")
    # The bounded search never tries its ends, and the whole length is what a rectangular sole has.
    a = max(float(best.x), longest, key=lambda length: length * widest(length)[2])
    x, y, b = widest(a)
    return Rectangle(np.array([x, y, layer[:, 2].min()]), np.array([a, b])) if a * b > 0.0 else None
