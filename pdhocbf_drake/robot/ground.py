"""Between the ground's wrenches and the ZMP."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.jit import compiled

_LEAST_FORCE = 1e-6  # [N]: less than this has no ZMP


@compiled
def left_share_of_zmp(zmp: np.ndarray, left: np.ndarray, right: np.ndarray) -> float:
    """Where the ZMP (2,) projects on the way from the right sole's centre (2,) to the left's: 0 … 1."""
    way_x, way_y = left[0] - right[0], left[1] - right[1]
    length = way_x * way_x + way_y * way_y
    if length == 0.0:
        return 0.5
    share = ((zmp[0] - right[0]) * way_x + (zmp[1] - right[1]) * way_y) / length
    return min(max(share, 0.0), 1.0)


@compiled
def zmp_of_wrenches(
    on_left: np.ndarray, left: np.ndarray, on_right: np.ndarray, right: np.ndarray
) -> tuple[float, float]:
    """Point x, y on the ground where the wrenches on both soles have no horizontal moment [m].

    Args:
        on_left, on_right: force and moment on a sole, at its centre (6,) [N, N m].
        left, right: the soles' centres (3,) [m].
    """
    force = about_x = about_y = 0.0
    for wrench, sole in ((on_left, left), (on_right, right)):
        about_x += wrench[3] + sole[1] * wrench[2] - sole[2] * wrench[1]
        about_y += wrench[4] + sole[2] * wrench[0] - sole[0] * wrench[2]
        force += wrench[2]
    force = max(force, _LEAST_FORCE)
    return -about_y / force, about_x / force
