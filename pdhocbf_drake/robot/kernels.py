"""Contact wrenches and ZMP as machine code; kinematics and dynamics are in `multibody`.

Each kernel writes into the arrays that it is given; `tests/test_robot_kernels.py` holds a numpy reference of each.
Poses (39,) are the CoM (3), then rotation and origin, (3, 4) row by row, of torso, left and right sole.
"""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.jit import compiled

_LEFT = 6  # in task coordinates: the soles
_LEFT_POSE, _RIGHT_POSE = 15, 27  # in poses
_LEAST_FORCE = 1e-6  # [N]: a smaller vertical force has no ZMP


@compiled
def write_shared_wrench(
    needed: np.ndarray, base: np.ndarray, joints: np.ndarray, q: np.ndarray, origin: np.ndarray, poses: np.ndarray,
    share: float, jacobian: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """Joint torques (12,), then force and moment on the left and on the right sole, each at its centre; `out` (24,).

    The rows of the floating base in the generalized forces `needed` (18,) are the ground's moment about the base's
    origin and its force. Both are moved to the point that divides the way between the soles by `share` (1 at the left
    one), and shared likewise. What is left of the other rows when the wrenches have done their part are the torques.

    Args:
        base, joints: places of the base's moment and force (6,) and of the joints (12,) in v.
        q: positions. origin: places of the base's origin in q (3,).
    """
    mx, my, mz = needed[base[0]], needed[base[1]], needed[base[2]]
    fx, fy, fz = needed[base[3]], needed[base[4]], needed[base[5]]
    rest = 1.0 - share
    # The origin is the last column of a pose (3, 4).
    x = share * poses[_LEFT_POSE + 3] + rest * poses[_RIGHT_POSE + 3] - q[origin[0]]
    y = share * poses[_LEFT_POSE + 7] + rest * poses[_RIGHT_POSE + 7] - q[origin[1]]
    z = share * poses[_LEFT_POSE + 11] + rest * poses[_RIGHT_POSE + 11] - q[origin[2]]
    wrench = (fx, fy, fz, mx - (y * fz - z * fy), my - (z * fx - x * fz), mz - (x * fy - y * fx))
    count = len(joints)
    for i in range(6):
        out[count + i], out[count + 6 + i] = share * wrench[i], rest * wrench[i]
    for j in range(count):
        torque = needed[joints[j]]
        for i in range(12):
            torque -= out[count + i] * jacobian[_LEFT + i, joints[j]]
        out[j] = torque


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
