"""Kinematics and dynamics of a tree of rigid links, and the robot's task coordinates, as machine code.

A tree is two arrays, see `tree.Tree`: `links` (n, 3), whole numbers, has for each link its parent and the places of its
joint in q and v; `numbers` (n, 25) has what does not change. Parents stand before their children, the floating base
first; the last three links are frames without a joint: torso, left and right sole. Each kernel writes into the arrays
that it is given; `work` (n, 33) takes what is known of the links in the world, and a kernel reads there what the one
that its docstring names has written. `tests/test_multibody_kernels.py` compares all of them with Drake or numpy.

Task coordinates (18,) are ordered as in `posture`: CoM, torso turn, left sole, its turn, right sole, its turn. Poses
(39,) are the CoM (3), then rotation and origin, (3, 4) row by row, of torso, left and right sole.
"""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.jit import compiled

Vector = tuple[float, float, float]

PARENT, Q, V = 0, 1, 2
"""Columns of `links`: the base has no parent, −1, and a frame no place in q and v, −1."""

OFFSET, MASS, MOMENT, INERTIA, DAMPING, ROTOR, CARRIED = 9, 12, 13, 16, 22, 23, 24
"""Columns of `numbers`: rotation (at 0, row by row) and origin of a link in its parent at angle 0, the joint's axis as
its z; mass; along the link's axes mass times CoM and inertia about its origin, xx, yy, zz, xy, xz, yz; damping and
reflected inertia of the joint; mass with all children."""

ORIGIN, OMEGA, ALPHA, ACCELERATION, FORCE, TORQUE, FIRST, ALL_FIRST, WORK = 9, 12, 15, 18, 21, 24, 27, 30, 33
"""Columns of `work`, in the world: rotation (at 0) and origin; angular velocity and acceleration; acceleration of the
origin; force and moment about the origin; mass times CoM from the origin; the same with all children, from the world's
origin; then the number of columns."""

TASKS, FRAMES = 18, 3
_LEFT_POSE, _RIGHT_POSE = 15, 27  # in poses
_TURN, _SOLE = 3, 6  # in task coordinates: the first turn and the first sole; the next ones are 6 behind
_HALF_TURN = 1e-3  # sine of an angle near half a revolution
_SMALL_TURN = 2.99  # trace of a rotation matrix, 1 + 2 cos: above it the sine of the angle stands for the angle


@compiled
def vector(table: np.ndarray, row: int, column: int) -> Vector:
    """Three entries of a row."""
    return table[row, column], table[row, column + 1], table[row, column + 2]


@compiled
def store(value: Vector, table: np.ndarray, row: int, column: int) -> None:
    """Writes three entries of a row."""
    table[row, column], table[row, column + 1], table[row, column + 2] = value


@compiled
def store_column(value: Vector, table: np.ndarray, row: int, column: int) -> None:
    """Writes three entries of a column."""
    table[row, column], table[row + 1, column], table[row + 2, column] = value


@compiled
def plus(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def times(s: float, a: Vector) -> Vector:
    """s a."""
    return s * a[0], s * a[1], s * a[2]


@compiled
def cross(a: Vector, b: Vector) -> Vector:
    """a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def turned(table: np.ndarray, row: int, a: Vector) -> Vector:
    """R a, for the rotation R with which a row begins."""
    return (
        table[row, 0] * a[0] + table[row, 1] * a[1] + table[row, 2] * a[2],
        table[row, 3] * a[0] + table[row, 4] * a[1] + table[row, 5] * a[2],
        table[row, 6] * a[0] + table[row, 7] * a[1] + table[row, 8] * a[2],
    )


@compiled
def turned_back(table: np.ndarray, row: int, a: Vector) -> Vector:
    """Rᵀ a, likewise."""
    return (
        table[row, 0] * a[0] + table[row, 3] * a[1] + table[row, 6] * a[2],
        table[row, 1] * a[0] + table[row, 4] * a[1] + table[row, 7] * a[2],
        table[row, 2] * a[0] + table[row, 5] * a[1] + table[row, 8] * a[2],
    )


@compiled
def times_inertia(numbers: np.ndarray, row: int, a: Vector) -> Vector:
    """I a, with the link's inertia, all along its axes."""
    xx, yy, zz = vector(numbers, row, INERTIA)
    xy, xz, yz = vector(numbers, row, INERTIA + 3)
    return (
        xx * a[0] + xy * a[1] + xz * a[2],
        xy * a[0] + yy * a[1] + yz * a[2],
        xz * a[0] + yz * a[1] + zz * a[2],
    )


@compiled
def axis(work: np.ndarray, row: int) -> Vector:
    """The axis of a link's joint, z of the link."""
    return work[row, 2], work[row, 5], work[row, 8]


@compiled
def place(q: np.ndarray, links: np.ndarray, numbers: np.ndarray, work: np.ndarray) -> None:
    """Rotation and origin of every link at q, and its mass times CoM.

    R = R_parent R_offset R_z(angle),  p = p_parent + R_parent p_offset;  of the base from quaternion and place.
    """
    count, first = len(links), links[0, Q]
    w, x, y, z = q[first], q[first + 1], q[first + 2], q[first + 3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    store((1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)), work, 0, 0)
    store((s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)), work, 0, 3)
    store((s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)), work, 0, 6)
    store((q[first + 4], q[first + 5], q[first + 6]), work, 0, ORIGIN)
    for i in range(1, count):
        parent, joint, sine, cosine = links[i, PARENT], links[i, Q], 0.0, 1.0
        if joint >= 0:
            sine, cosine = math.sin(q[joint]), math.cos(q[joint])
        for r in range(0, 9, 3):
            row = vector(work, parent, r)
            a = row[0] * numbers[i, 0] + row[1] * numbers[i, 3] + row[2] * numbers[i, 6]
            b = row[0] * numbers[i, 1] + row[1] * numbers[i, 4] + row[2] * numbers[i, 7]
            c = row[0] * numbers[i, 2] + row[1] * numbers[i, 5] + row[2] * numbers[i, 8]
            store((cosine * a + sine * b, cosine * b - sine * a, c), work, i, r)
        store(plus(vector(work, parent, ORIGIN), turned(work, parent, vector(numbers, i, OFFSET))), work, i, ORIGIN)
    for i in range(count):
        store(turned(work, i, vector(numbers, i, MOMENT)), work, i, FIRST)
        store(plus(vector(work, i, FIRST), times(numbers[i, MASS], vector(work, i, ORIGIN))), work, i, ALL_FIRST)
    for i in range(count - 1, 0, -1):
        parent = links[i, PARENT]
        store(plus(vector(work, parent, ALL_FIRST), vector(work, i, ALL_FIRST)), work, parent, ALL_FIRST)


@compiled
def write_poses(q: np.ndarray, links: np.ndarray, numbers: np.ndarray, work: np.ndarray, poses: np.ndarray) -> None:
    """`place`, and poses (39,)."""
    place(q, links, numbers, work)
    for r in range(3):
        poses[r] = work[0, ALL_FIRST + r] / numbers[0, CARRIED]
        for frame in range(FRAMES):
            here, start = len(work) - FRAMES + frame, 3 + 12 * frame + 4 * r
            poses[start], poses[start + 1], poses[start + 2] = vector(work, here, 3 * r)
            poses[start + 3] = work[here, ORIGIN + r]


@compiled
def write_jacobian(links: np.ndarray, numbers: np.ndarray, work: np.ndarray, jacobian: np.ndarray) -> None:
    """The task Jacobian (18, 18) after `place`.

    A joint with axis a through o turns what it carries with a and moves a point r with a × (r − o); so do the base's
    three angular velocities, with the world's axes through its origin. The CoM moves with a × (r − o) m/M, where r and
    m are the CoM and the mass of what the joint carries.
    """
    frames, first, total = len(links) - FRAMES, links[0, V], numbers[0, CARRIED]
    for i in range(TASKS):
        for j in range(TASKS):
            jacobian[i, j] = 0.0
    for part in range(FRAMES):  # CoM, left and right sole
        end = vector(work, frames + part, ORIGIN) if part > 0 else times(1.0 / total, vector(work, 0, ALL_FIRST))
        x, y, z = plus(end, times(-1.0, vector(work, 0, ORIGIN)))
        moves, turns = 6 * part, _TURN + 6 * part
        store((0.0, z, -y), jacobian, moves, first)
        store((-z, 0.0, x), jacobian, moves + 1, first)
        store((y, -x, 0.0), jacobian, moves + 2, first)
        for r in range(3):
            jacobian[moves + r, first + 3 + r] = jacobian[turns + r, first + r] = 1.0
    for i in range(1, frames):
        way = plus(vector(work, i, ALL_FIRST), times(-numbers[i, CARRIED], vector(work, i, ORIGIN)))
        store_column(times(1.0 / total, cross(axis(work, i), way)), jacobian, 0, links[i, V])
    for frame in range(FRAMES):
        i, turns = links[frames + frame, PARENT], _TURN + 6 * frame
        while i > 0:
            store_column(axis(work, i), jacobian, turns, links[i, V])
            if frame > 0:
                way = plus(vector(work, frames + frame, ORIGIN), times(-1.0, vector(work, i, ORIGIN)))
                store_column(cross(axis(work, i), way), jacobian, turns - 3, links[i, V])
            i = links[i, PARENT]


@compiled
def accelerate(
    v: np.ndarray, vdot: np.ndarray, lift: Vector, links: np.ndarray, numbers: np.ndarray, work: np.ndarray
) -> None:
    """Motion of every link at v and v̇, and the rate of its momentum, after `place`.

    With the way d from the parent's origin, mass m, and mass times CoM s from the origin:

        ω = ω_p + a q̇,  α = α_p + a q̈ + ω_p × a q̇,  p̈ = p̈_p + α_p × d + ω_p × (ω_p × d),
        f = m p̈ + α × s + ω × (ω × s),  n = I α + ω × I ω + s × p̈.

    `lift` is added to the base's acceleration: minus gravity [m/s²] for inverse dynamics.
    """
    first = links[0, V]
    store((v[first], v[first + 1], v[first + 2]), work, 0, OMEGA)
    store((vdot[first], vdot[first + 1], vdot[first + 2]), work, 0, ALPHA)
    store(plus((vdot[first + 3], vdot[first + 4], vdot[first + 5]), lift), work, 0, ACCELERATION)
    for i in range(len(links)):
        if i > 0:
            parent, joint = links[i, PARENT], links[i, V]
            omega, alpha = vector(work, parent, OMEGA), vector(work, parent, ALPHA)
            way = plus(vector(work, i, ORIGIN), times(-1.0, vector(work, parent, ORIGIN)))
            turning = plus(cross(alpha, way), cross(omega, cross(omega, way)))
            store(plus(vector(work, parent, ACCELERATION), turning), work, i, ACCELERATION)
            if joint >= 0:
                spin = times(v[joint], axis(work, i))
                alpha = plus(alpha, plus(times(vdot[joint], axis(work, i)), cross(omega, spin)))
                omega = plus(omega, spin)
            store(omega, work, i, OMEGA)
            store(alpha, work, i, ALPHA)
        omega, alpha, acceleration = vector(work, i, OMEGA), vector(work, i, ALPHA), vector(work, i, ACCELERATION)
        moment = vector(work, i, FIRST)
        turning = plus(cross(alpha, moment), cross(omega, cross(omega, moment)))
        store(plus(times(numbers[i, MASS], acceleration), turning), work, i, FORCE)
        spin = turned_back(work, i, omega)
        rate = plus(
            times_inertia(numbers, i, turned_back(work, i, alpha)), cross(spin, times_inertia(numbers, i, spin))
        )
        store(plus(turned(work, i, rate), cross(moment, acceleration)), work, i, TORQUE)


@compiled
def write_bias(
    v: np.ndarray, rest: np.ndarray, links: np.ndarray, numbers: np.ndarray, work: np.ndarray, bias: np.ndarray
) -> None:
    """J̇v (18,) after `place`: the acceleration of the task coordinates where v̇ is zero, the array `rest` (18,)."""
    accelerate(v, rest, (0.0, 0.0, 0.0), links, numbers, work)
    frames = len(work) - FRAMES
    force = (0.0, 0.0, 0.0)
    for i in range(frames):
        force = plus(force, vector(work, i, FORCE))
    bias[0], bias[1], bias[2] = times(1.0 / numbers[0, CARRIED], force)
    for frame in range(FRAMES):
        for r in range(3):
            bias[_TURN + 6 * frame + r] = work[frames + frame, ALPHA + r]
            if frame > 0:
                bias[6 * frame + r] = work[frames + frame, ACCELERATION + r]


@compiled
def write_forces(
    v: np.ndarray, vdot: np.ndarray, lift: Vector, links: np.ndarray, numbers: np.ndarray, work: np.ndarray,
    forces: np.ndarray,
) -> None:  # fmt: skip
    """Generalized forces (18,) of a motion after `place`, M v̇ + C v − τ_g + damping [N m, N].

    Each joint carries the forces and moments of its link and of all its children: a · n + d q̇ + reflected inertia q̈.
    """
    accelerate(v, vdot, lift, links, numbers, work)
    for i in range(len(links) - 1, 0, -1):
        parent, joint = links[i, PARENT], links[i, V]
        force, torque = vector(work, i, FORCE), vector(work, i, TORQUE)
        if joint >= 0:
            x, y, z = axis(work, i)
            forces[joint] = x * torque[0] + y * torque[1] + z * torque[2]
            forces[joint] += numbers[i, DAMPING] * v[joint] + numbers[i, ROTOR] * vdot[joint]
        way = plus(vector(work, i, ORIGIN), times(-1.0, vector(work, parent, ORIGIN)))
        store(plus(vector(work, parent, FORCE), force), work, parent, FORCE)
        store(plus(vector(work, parent, TORQUE), plus(torque, cross(way, force))), work, parent, TORQUE)
    first = links[0, V]
    for r in range(3):
        forces[first + r], forces[first + 3 + r] = work[0, TORQUE + r], work[0, FORCE + r]


@compiled
def write_inertial_forces(
    accelerations: np.ndarray, rest: np.ndarray, links: np.ndarray, numbers: np.ndarray, work: np.ndarray,
    forces: np.ndarray,
) -> None:  # fmt: skip
    """M a for each row a of the accelerations, after `place`, (n, 18) each; `rest` is a velocity of zero (18,)."""
    for i in range(len(accelerations)):
        write_forces(rest, accelerations[i], (0.0, 0.0, 0.0), links, numbers, work, forces[i])


@compiled
def write_com_velocity(
    v: np.ndarray, links: np.ndarray, numbers: np.ndarray, work: np.ndarray, velocity: np.ndarray
) -> None:
    """Velocity of the CoM (3,) at v after `place`: J_com v."""
    total, first = numbers[0, CARRIED], links[0, V]
    way = plus(times(1.0 / total, vector(work, 0, ALL_FIRST)), times(-1.0, vector(work, 0, ORIGIN)))
    found = plus((v[first + 3], v[first + 4], v[first + 5]), cross((v[first], v[first + 1], v[first + 2]), way))
    for i in range(1, len(links) - FRAMES):
        way = plus(vector(work, i, ALL_FIRST), times(-numbers[i, CARRIED], vector(work, i, ORIGIN)))
        found = plus(found, times(v[links[i, V]] / total, cross(axis(work, i), way)))
    velocity[0], velocity[1], velocity[2] = found


@compiled
def write_poses_and_velocity(
    q: np.ndarray, v: np.ndarray, links: np.ndarray, numbers: np.ndarray, work: np.ndarray, poses: np.ndarray,
    velocity: np.ndarray,
) -> None:  # fmt: skip
    """`write_poses` at q (n_q,), and `write_com_velocity` at v."""
    write_poses(q, links, numbers, work, poses)
    write_com_velocity(v, links, numbers, work, velocity)


@compiled
def move(q: np.ndarray, step: np.ndarray, links: np.ndarray, out: np.ndarray) -> None:
    """q ⊕ step: one step along q̇ = N(q) v, with the quaternion normalized.

    A step (18,) of joints and base is added; one of rotation, a vector r in the world, adds ½ (0, r) ⊗ quaternion.
    """
    first, start = links[0, Q], links[0, V]
    w, x, y, z = q[first], q[first + 1], q[first + 2], q[first + 3]
    a, b, c = 0.5 * step[start], 0.5 * step[start + 1], 0.5 * step[start + 2]
    w, x, y, z = (
        w - a * x - b * y - c * z,
        x + a * w + b * z - c * y,
        y + b * w + c * x - a * z,
        z + c * w + a * y - b * x,
    )
    length = math.sqrt(w * w + x * x + y * y + z * z)
    out[first], out[first + 1], out[first + 2], out[first + 3] = w / length, x / length, y / length, z / length
    for r in range(3):
        out[first + 4 + r] = q[first + 4 + r] + step[start + 3 + r]
    for i in range(1, len(links) - FRAMES):
        out[links[i, Q]] = q[links[i, Q]] + step[links[i, V]]


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
def within_limits(q: np.ndarray, joints: np.ndarray, lower: np.ndarray, upper: np.ndarray, quaternion: int) -> bool:
    """Whether every joint of q (n_q,) is within its limits and the quaternion has length one; false for NaN.

    The joints' places in q and their limits [rad] have shape (n,); the quaternion begins at its place.
    """
    for i in range(len(joints)):
        if not (q[joints[i]] >= lower[i] and q[joints[i]] <= upper[i]):
            return False
    square = 0.0
    for i in range(quaternion, quaternion + 4):
        square += q[i] * q[i]
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
def write_error(rows: np.ndarray, offset: np.ndarray, poses: np.ndarray, out: np.ndarray) -> bool:
    """The task error (18,) = offset + the first 18 of the rows (21, 39) · poses; false near half a revolution.

    The last three rows give the traces of the turns that remain, see `posture.TargetPoses`. Unless all of them are
    small, each axis times sine becomes axis times angle; half a revolution has neither sine nor axis.
    """
    cosines, small = (0.0, 0.0, 0.0), True
    for i in range(len(rows)):
        total = offset[i] if i < TASKS else 0.0
        for j in range(len(poses)):
            total += rows[i, j] * poses[j]
        if i < TASKS:
            out[i] = total
        else:
            small = small and total >= _SMALL_TURN
            cosines = (cosines[1], cosines[2], 0.5 * (total - 1.0))
    if small:
        return True
    for frame in range(FRAMES):
        at, cosine = _TURN + 6 * frame, cosines[frame]
        sine = math.sqrt(out[at] * out[at] + out[at + 1] * out[at + 1] + out[at + 2] * out[at + 2])
        if cosine < 0.0 and sine < _HALF_TURN:
            return False
        if sine > 0.0:
            for r in range(3):
                out[at + r] *= math.atan2(sine, cosine) / sine
    return True


@compiled
def approach(
    q: np.ndarray, rows: np.ndarray, offset: np.ndarray, tolerance: float, steps: int, longest: float,
    joints: np.ndarray, lower: np.ndarray, upper: np.ndarray, links: np.ndarray, numbers: np.ndarray, work: np.ndarray,
    poses: np.ndarray, error: np.ndarray, step: np.ndarray, moved: np.ndarray, factors: np.ndarray, pivots: np.ndarray,
) -> int:  # fmt: skip
    """Newton's method q ← q ⊕ J(q)⁻¹ e(q) on q (n_q,) in place: the number of steps after which the error e is small.

    It gives up, and returns −1 − the steps taken, where a turn of the error is near half a revolution, J is singular,
    an entry of a step is larger than `longest`, or q would leave its limits. After a success `work` and `poses` are
    those of q.

    Args:
        rows, offset: of the target, see `write_error`.
        tolerance: of the largest error [m, rad]. steps: the most. longest: entry of a step [m, rad].
        joints, lower, upper: see `within_limits`.
        error, step, moved, factors, pivots: room for the error, a step, the next q, the factors of J and their pivots.
    """
    for done in range(steps):
        write_poses(q, links, numbers, work, poses)
        if not write_error(rows, offset, poses, error):
            return -1 - done
        if largest(error) < tolerance:
            return done
        write_jacobian(links, numbers, work, factors)
        if not factorize(factors, pivots):
            return -1 - done
        substitute(factors, pivots, error, step)
        if not largest(step) <= longest:
            return -1 - done
        move(q, step, links, moved)
        if not within_limits(moved, joints, lower, upper, links[0, Q]):
            return -1 - done
        for i in range(len(q)):
            q[i] = moved[i]
    return -1 - steps


@compiled
def follow(
    rates: np.ndarray, accelerations: np.ndarray, joints: np.ndarray, speeds: np.ndarray, most: float,
    links: np.ndarray, numbers: np.ndarray, work: np.ndarray, jacobian: np.ndarray, factors: np.ndarray,
    pivots: np.ndarray, bias: np.ndarray, v: np.ndarray, vdot: np.ndarray,
) -> bool:  # fmt: skip
    """v and v̇ (18,) with J v = rates and J v̇ + J̇v = accelerations, both (18,), and J (18, 18) after `place`.

    False where J is singular, or an entry of v or v̇ is not below `most`. Joint speeds, at their places in v, are then
    clipped to their limits.
    """
    write_jacobian(links, numbers, work, jacobian)
    for i in range(TASKS):
        vdot[i] = 0.0
        for j in range(TASKS):
            factors[i, j] = jacobian[i, j]
    if not factorize(factors, pivots):
        return False
    substitute(factors, pivots, rates, v)
    if not largest(v) < most:
        return False
    limit(v, joints, speeds)
    write_bias(v, vdot, links, numbers, work, bias)
    for i in range(TASKS):
        bias[i] = accelerations[i] - bias[i]
    substitute(factors, pivots, bias, vdot)
    return largest(vdot) < most


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
            torque -= out[count + i] * jacobian[_SOLE + i, joints[j]]
        out[j] = torque


@compiled
def move_along(
    seed: np.ndarray, rows: np.ndarray, offset: np.ndarray, wanted: np.ndarray, share: float, tolerance: float,
    steps: int, longest: float, farthest: float, most: float, places: np.ndarray, bounds: np.ndarray, base: np.ndarray,
    lift: Vector, links: np.ndarray, numbers: np.ndarray, work: np.ndarray, poses: np.ndarray, vectors: np.ndarray,
    matrices: np.ndarray, pivots: np.ndarray, out: np.ndarray,
) -> tuple[int, float]:  # fmt: skip
    """A tick's motion and what it takes: `approach`, `follow`, `write_forces` and `write_shared_wrench` one by one.

    Returns the steps taken and the largest error, or −1 and infinity where the seed is not within the limits, or one of
    the first two gives up. `out` holds q, v, v̇ (18,), and torques and wrenches (24,).

    Args:
        seed: q to begin with (n_q,), see `approach` for it and for `rows` … `longest`.
        wanted: its rows 1 and 2 are rates and accelerations, see `follow`, also for `most`.
        share: see `write_shared_wrench`. farthest: that an entry of offset or seed may be.
        places: of the joints in q and in v (2, 12). bounds: lower, upper, largest speed (3, 12). base: places of the
            base's moment and force in v, and of its origin in q (9,).
        vectors: room (4, n_q). matrices: J and its factors (2, 18, 18). pivots: of the latter.
    """
    joints, rates, count = places[0], places[1], len(seed)
    good = largest(offset) < farthest and largest(seed) < farthest
    if not (good and within_limits(seed, joints, bounds[0], bounds[1], links[0, Q])):
        return -1, np.inf
    q, v, vdot = out[:count], out[count : count + TASKS], out[count + TASKS : count + 2 * TASKS]
    error, step, bias = vectors[0, :TASKS], vectors[1, :TASKS], vectors[2, :TASKS]
    for i in range(count):
        q[i] = seed[i]
    done = approach(
        q, rows, offset, tolerance, steps, longest, joints, bounds[0], bounds[1], links, numbers, work, poses, error,
        step, vectors[3], matrices[1], pivots,
    )  # fmt: skip
    if done < 0:
        return -1, np.inf
    followed = follow(
        wanted[1], wanted[2], rates, bounds[2], most, links, numbers, work, matrices[0], matrices[1], pivots, bias, v,
        vdot,
    )  # fmt: skip
    if not followed:
        return -1, np.inf
    write_forces(v, vdot, lift, links, numbers, work, step)
    write_shared_wrench(step, base[:6], rates, q, base[6:], poses, share, matrices[0], out[count + 2 * TASKS :])
    return done, largest(error)


@compiled
def write_product(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    """a b of two square matrices (n, n); zeros in a cost nothing."""
    n = len(a)
    for i in range(n):
        for j in range(n):
            out[i, j] = 0.0
        for k in range(n):
            if a[i, k] != 0.0:
                for j in range(n):
                    out[i, j] += a[i, k] * b[k, j]


@compiled
def weigh(weights: np.ndarray, error: np.ndarray, weighted: np.ndarray) -> float:
    """Writes W e (18,); its square."""
    total = 0.0
    for i in range(TASKS):
        weighted[i] = 0.0
        for j in range(TASKS):
            weighted[i] += weights[i, j] * error[j]
        total += weighted[i] * weighted[i]
    return total


@compiled
def clip_joints(q: np.ndarray, joints: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> None:
    """Clips the joints, at their places in q, to their limits, shape of the places."""
    for i in range(len(joints)):
        q[joints[i]] = min(max(q[joints[i]], lower[i]), upper[i])


@compiled
def descend(
    q: np.ndarray, rows: np.ndarray, offset: np.ndarray, weights: np.ndarray, tolerance: float, steps: int,
    joints: np.ndarray, rates: np.ndarray, lower: np.ndarray, upper: np.ndarray, links: np.ndarray,
    numbers: np.ndarray, work: np.ndarray, poses: np.ndarray, vectors: np.ndarray, moved: np.ndarray,
    matrices: np.ndarray, pivots: np.ndarray,
) -> tuple[int, float, bool]:  # fmt: skip
    """Levenberg-Marquardt on q (n_q,) in place, as in `damped.nearest_posture`: steps, damping, and whether it is done.

    It is not where a turn of the error is near half a revolution: q is then the last one before.

    Args:
        rows, offset: of the target. weights: W (18, 18). tolerance: of the largest error. steps: the most.
        joints, rates: places of the joints in q and v. lower, upper: their limits.
        vectors: room (5, 18). moved: the next q (n_q,). matrices: room (3, 18, 18). pivots: room (18,).
    """
    error, trial_error, weighted, gradient, step = vectors[0], vectors[1], vectors[2], vectors[3], vectors[4]
    jacobian, tilted, normal = matrices[0], matrices[1], matrices[2]
    damping, done = 1e-3, 0
    write_poses(q, links, numbers, work, poses)
    if not write_error(rows, offset, poses, error):
        return done, damping, False
    while done < steps and damping < 1e6 and largest(error) >= tolerance:
        write_poses(q, links, numbers, work, poses)
        write_jacobian(links, numbers, work, jacobian)
        write_product(weights, jacobian, tilted)
        square = weigh(weights, error, weighted)
        for j in range(TASKS):
            gradient[j] = 0.0
            for i in range(TASKS):
                gradient[j] += tilted[i, j] * weighted[i]
        for i in range(TASKS):
            for j in range(TASKS):
                normal[i, j] = 0.0
        for k in range(TASKS):
            for i in range(TASKS):
                if tilted[k, i] != 0.0:
                    for j in range(TASKS):
                        normal[i, j] += tilted[k, i] * tilted[k, j]
        for i in range(TASKS):
            normal[i, i] += damping
        for i in range(len(joints)):
            at, angle, outward = rates[i], q[joints[i]], gradient[rates[i]]
            if (angle <= lower[i] and outward < 0.0) or (angle >= upper[i] and outward > 0.0):
                for j in range(TASKS):
                    normal[at, j] = normal[j, at] = 0.0
                normal[at, at], gradient[at] = 1.0, 0.0
        factorize(normal, pivots)
        substitute(normal, pivots, gradient, step)
        move(q, step, links, moved)
        clip_joints(moved, joints, lower, upper)
        write_poses(moved, links, numbers, work, poses)
        if not write_error(rows, offset, poses, trial_error):
            return done, damping, False
        done += 1
        if weigh(weights, trial_error, weighted) < square:
            change = 0.0
            for i in range(len(q)):
                change = max(change, abs(moved[i] - q[i]))
                q[i] = moved[i]
            for i in range(TASKS):
                error[i] = trial_error[i]
            damping = max(damping / 5.0, 1e-12)
            if change < 1e-9:
                break
        else:
            damping *= 10.0
    return done, damping, True
