"""The robot's arithmetic of a tick as machine code: linear algebra, joints, task coordinates, contact wrenches.

Each kernel writes into the arrays that it is given; `tests/test_robot_kernels.py` holds a numpy reference of each.
Task coordinates (18,) are ordered as in `posture`: CoM, torso turn, left sole, its turn, right sole, its turn. Poses
(39,) are the CoM (3), then rotation and origin, (3, 4) row by row, of torso, left and right sole.
"""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.jit import compiled

_TASKS = 18
_COM, _TORSO, _LEFT, _LEFT_TURN, _RIGHT, _RIGHT_TURN = 0, 3, 6, 9, 12, 15  # in task coordinates
_TORSO_POSE, _LEFT_POSE, _RIGHT_POSE = 3, 15, 27  # in poses
_SMALL_TURN = 2.99  # trace of a rotation matrix, 1 + 2 cos: above it the sine of the angle stands for the angle
_LEAST_FORCE = 1e-6  # [N]: a smaller vertical force has no ZMP


@compiled
def factorize(matrix: np.ndarray, pivots: np.ndarray) -> bool:
    """Overwrites a matrix (n, n) with its LU factors; false where it is singular or holds NaN.

    Row k has been exchanged with row pivots[k], shape (n,), whole numbers.
    """
    n = len(matrix)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivots[k] = best
        if not abs(matrix[best, k]) > 0.0:  # zero or NaN
            return False
        if best != k:
            for j in range(n):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            matrix[i, k] = factor
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
    return True


@compiled
def substitute(factors: np.ndarray, pivots: np.ndarray, right: np.ndarray, x: np.ndarray) -> None:
    """Writes the solution x (n,) for a right-hand side (n,), from the result of `factorize`."""
    n = len(factors)
    for k in range(n):
        x[k] = right[k]
    for k in range(n):
        x[k], x[pivots[k]] = x[pivots[k]], x[k]
    for i in range(n):
        for j in range(i):
            x[i] -= factors[i, j] * x[j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= factors[i, j] * x[j]
        x[i] /= factors[i, i]


@compiled
def move_along(q: np.ndarray, step: np.ndarray, quaternion: np.ndarray, out: np.ndarray) -> None:
    """Writes q + step, all (n_q,), with the quaternion, at these four places of q, normalized."""
    for i in range(len(q)):
        out[i] = q[i] + step[i]
    square = 0.0
    for place in quaternion:
        square += out[place] * out[place]
    for place in quaternion:
        out[place] /= math.sqrt(square)


@compiled
def within_limits(
    q: np.ndarray, joints: np.ndarray, lower: np.ndarray, upper: np.ndarray, quaternion: np.ndarray
) -> bool:
    """Whether every joint of q (n_q,) is within its limits and the quaternion has length one; false for NaN.

    The joints' places in q and their limits [rad] have shape (n,), the quaternion's places (4,).
    """
    for i in range(len(joints)):
        if not (q[joints[i]] >= lower[i] and q[joints[i]] <= upper[i]):
            return False
    square = 0.0
    for place in quaternion:
        square += q[place] * q[place]
    return abs(square - 1.0) < 1e-12


@compiled
def limit(vector: np.ndarray, places: np.ndarray, most: np.ndarray) -> None:
    """Clips the entries at these places of a vector to ± most, shape of the places; NaN stays."""
    for i in range(len(places)):
        value = vector[places[i]]
        if abs(value) > most[i]:
            vector[places[i]] = math.copysign(most[i], value)


@compiled
def largest(vector: np.ndarray) -> float:
    """The largest magnitude of a vector (n,); NaN where it holds one."""
    most = 0.0
    for value in vector:
        if not abs(value) <= most:
            most = abs(value)
            if most != most:
                return most
    return most


@compiled
def write_poses(com: np.ndarray, torso: np.ndarray, left: np.ndarray, right: np.ndarray, out: np.ndarray) -> None:
    """Poses (39,) from the CoM (3,) and three poses (3, 4)."""
    for i in range(3):
        out[i] = com[i]
        for j in range(4):
            out[_TORSO_POSE + 4 * i + j] = torso[i, j]
            out[_LEFT_POSE + 4 * i + j] = left[i, j]
            out[_RIGHT_POSE + 4 * i + j] = right[i, j]


@compiled
def write_error(rows: np.ndarray, offset: np.ndarray, poses: np.ndarray, out: np.ndarray) -> bool:
    """The task error (18,) = offset + the first 18 of the rows (21, 39) · poses; whether all three turns are small.

    The last three rows give the traces of the turns that remain, see `posture.TargetPoses`.
    """
    small = True
    for i in range(len(rows)):
        total = offset[i] if i < _TASKS else 0.0
        for j in range(len(poses)):
            total += rows[i, j] * poses[j]
        if i < _TASKS:
            out[i] = total
        else:
            small = small and total >= _SMALL_TURN
    return small


@compiled
def write_jacobian(
    com: np.ndarray, torso: np.ndarray, left: np.ndarray, right: np.ndarray, out: np.ndarray, again: np.ndarray
) -> None:
    """The task Jacobian (18, 18), twice, from the CoM's (3, 18) and the spatial ones of three frames (6, 18).

    A spatial Jacobian has its three rotational rows first.
    """
    for i in range(3):
        for j in range(_TASKS):
            out[_COM + i, j], out[_TORSO + i, j] = com[i, j], torso[i, j]
            out[_LEFT + i, j], out[_LEFT_TURN + i, j] = left[3 + i, j], left[i, j]
            out[_RIGHT + i, j], out[_RIGHT_TURN + i, j] = right[3 + i, j], right[i, j]
    for i in range(_TASKS):
        for j in range(_TASKS):
            again[i, j] = out[i, j]


@compiled
def write_bias(
    force: np.ndarray, base: np.ndarray, mass: float, torso: np.ndarray, left: np.ndarray, right: np.ndarray,
    out: np.ndarray,
) -> None:  # fmt: skip
    """J̇v (18,) from the bias force C v (18,) and the spatial bias accelerations of three frames (6,).

    With v̇ = 0 the force on the floating base, at the last three of its places in v (6,), is the robot's mass times the
    acceleration of its CoM.
    """
    for i in range(3):
        out[_COM + i], out[_TORSO + i] = force[base[3 + i]] / mass, torso[i]
        out[_LEFT + i], out[_LEFT_TURN + i] = left[3 + i], left[i]
        out[_RIGHT + i], out[_RIGHT_TURN + i] = right[3 + i], right[i]


@compiled
def write_shared_wrench(
    needed: np.ndarray, base: np.ndarray, origin: np.ndarray, poses: np.ndarray, share: float, jacobian: np.ndarray,
    both: np.ndarray,
) -> None:  # fmt: skip
    """Subtracts the ground's part from the generalized forces `needed` (18,), leaving the joint torques.

    The rows of the floating base, at its places in v (6,), are the ground's moment about the base's origin (3,) and its
    force. Both are moved to the point that divides the way between the soles by `share` (1 at the left one), and shared
    likewise: `both` (12,) takes force and moment on the left sole, then on the right one, each at its centre.
    """
    mx, my, mz = needed[base[0]], needed[base[1]], needed[base[2]]
    fx, fy, fz = needed[base[3]], needed[base[4]], needed[base[5]]
    rest = 1.0 - share
    # The origin is the last column of a pose (3, 4).
    x = share * poses[_LEFT_POSE + 3] + rest * poses[_RIGHT_POSE + 3] - origin[0]
    y = share * poses[_LEFT_POSE + 7] + rest * poses[_RIGHT_POSE + 7] - origin[1]
    z = share * poses[_LEFT_POSE + 11] + rest * poses[_RIGHT_POSE + 11] - origin[2]
    wrench = (fx, fy, fz, mx - (y * fz - z * fy), my - (z * fx - x * fz), mz - (x * fy - y * fx))
    for i in range(6):
        both[i], both[6 + i] = share * wrench[i], rest * wrench[i]
    for j in range(_TASKS):
        for i in range(12):
            needed[j] -= both[i] * jacobian[_LEFT + i, j]


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
