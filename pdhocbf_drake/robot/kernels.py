"""Contact wrenches and ZMP as machine code; kinematics and dynamics are in `multibody`.

Each kernel writes into the arrays that it is given; `tests/test_robot_kernels.py` holds a numpy reference of each.
Poses (39,) are the CoM (3), then rotation and origin, (3, 4) row by row, of torso, left and right sole.
"""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.jit import compiled

_LEAST_FORCE = 1e-6  # [N]: a smaller vertical force has no ZMP


@compiled
def left_share_of_zmp(zmp: np.ndarray, left: np.ndarray, right: np.ndarray) -> float:
    """Projection of the ZMP (2,) onto the line from the right sole's centre (0) to the left one's (1), clipped.

    ½ where both centres are one point.
    """
    way_x, way_y = left[0] - right[0], left[1] - right[1]
    length = way_x * way_x + way_y * way_y
    if length == 0.0:
        return 0.5
    share = ((zmp[0] - right[0]) * way_x + (zmp[1] - right[1]) * way_y) / length
    return min(max(share, 0.0), 1.0)


@compiled
def left_share(left: np.ndarray, right: np.ndarray, zmp: np.ndarray) -> float:
    """The left sole's share of the load: none or all with a foot in the air, else `left_share_of_zmp`.

    Args:
        left, right: the soles' centres (3,) [m]. zmp: (2,) [m].
    """
    if left[2] > 0.0:
        return 0.0
    if right[2] > 0.0:
        return 1.0
    return left_share_of_zmp(zmp, left, right)


@compiled
def zmp_of_wrenches(
    on_left: np.ndarray, left: np.ndarray, on_right: np.ndarray, right: np.ndarray
) -> tuple[float, float]:
    """Point (x, y) of the plane z = 0 about which the wrenches on both soles have no horizontal moment [m].

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


@compiled
def use_of_ground(
    on_left: np.ndarray, left: np.ndarray, on_right: np.ndarray, right: np.ndarray
) -> tuple[float, float]:
    """|F_xy|/F_z of the force F on both soles, and M_z/F_z about the vertical through their ZMP [1, m].

    Arguments as in `zmp_of_wrenches`.
    """
    x, y = zmp_of_wrenches(on_left, left, on_right, right)
    force_x, force_y = on_left[0] + on_right[0], on_left[1] + on_right[1]
    force = max(on_left[2] + on_right[2], _LEAST_FORCE)
    moment = 0.0
    for wrench, sole in ((on_left, left), (on_right, right)):
        moment += wrench[5] + (sole[0] - x) * wrench[1] - (sole[1] - y) * wrench[0]
    return np.sqrt(force_x * force_x + force_y * force_y) / force, moment / force
