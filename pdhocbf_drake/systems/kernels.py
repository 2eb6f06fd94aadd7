"""The blocks' arithmetic of a tick as machine code.

Each kernel writes into the arrays that it is given; `tests/test_systems_kernels.py` holds a numpy reference of each.
The offsets below are those of `signals` and `robot.posture`; numba keeps a kernel until its own file changes, so they
are written here, and a test compares them.
"""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.jit import compiled

AXES = 3
FOOT, ACCELERATION = 9, 6  # of foot_reference: a sole's elements, and where its acceleration starts among them
COM, LEFT, RIGHT = 0, 6, 12  # of task coordinates
COM_Z, FEET, LOAD = 6, 8, 20  # of the state estimate: lip_state (6), com_z (2), foot_state (12), ground_load (1)
LEFT_POSE, RIGHT_POSE = 15, 27  # of poses
LEAST_LOAD = 0.0035  # share of the weight: with less vertical force no foot carries the robot, and there is no ZMP
NO_ZMP = 1e300  # [m]: where there has been no ZMP; a number, since 0 · NaN is NaN
LEARNING_RATE = 0.5  # weight of a new sample in the table of ZMP offsets [1]


@compiled
def write_h(
    signs: np.ndarray, axes: np.ndarray, normals: np.ndarray, stances: np.ndarray, lip_state: np.ndarray,
    bounds: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """h = sign · (V̄ − n · [c − f, v, p − f]) of n_b barriers, from the first samples of their bounds.

    Each depends on the state of its own axis alone, so that NaN on the other axis leaves it as it is.

    Args:
        signs: (n_b,). axes: 0 (x) or 1 (y), (n_b,). normals: n, (n_b, 3).
        stances: f, where c and p are counted from; 0 in the world, (n_b,) [m].
        bounds: as many samples of each, one after the other. out: h (n_b).
    """
    count = len(bounds) // len(signs)
    for i in range(len(signs)):
        c, v, p = lip_state[3 * axes[i]], lip_state[3 * axes[i] + 1], lip_state[3 * axes[i] + 2]
        value = 0.0
        for normal, part in ((normals[i, 0], c - stances[i]), (normals[i, 1], v), (normals[i, 2], p - stances[i])):
            value += normal * part
        out[i] = signs[i] * (bounds[count * i] - value)


@compiled
def write_estimate(
    poses: np.ndarray, velocity: np.ndarray, q: np.ndarray, origin: np.ndarray, force: np.ndarray, base: np.ndarray,
    ground: float, least: float, held: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """The state estimate, see `StateEstimator`: lip_state, com_z, foot_state and ground_load.

    A sole's rotation matrix is R_z(yaw) R_y(pitch) R_x(roll), as in Drake's `RollPitchYaw`, which takes four calls.

    Args:
        poses: CoM (3), then rotation and origin (3, 4) of torso, left and right sole, see `robot.task_space` (39,).
        velocity: of the CoM (3,) [m/s].
        q: positions. origin: places of the base's origin in q (3,).
        force: generalized contact forces (18,). base: places of the base's moment and force among them (6,).
        ground: height of the ZMP [m].
        least: vertical force above which there is a ZMP [N].
        held: the last ZMP (2,) [m]; `NO_ZMP` where there has been none.
    """
    mx, my = force[base[0]], force[base[1]]
    fx, fy, fz = force[base[3]], force[base[4]], force[base[5]]
    x, y, z = q[origin[0]], q[origin[1]], q[origin[2]] - ground
    zmp_x, zmp_y = held[0], held[1]
    if fz > least:
        zmp_x, zmp_y = x - (my + z * fx) / fz, y + (mx - z * fy) / fz
    elif not zmp_x < NO_ZMP:  # NaN, too
        zmp_x, zmp_y = poses[0], poses[1]
    out[0], out[1], out[2] = poses[0], velocity[0], zmp_x
    out[3], out[4], out[5] = poses[1], velocity[1], zmp_y
    out[LOAD] = fz
    out[COM_Z], out[COM_Z + 1] = poses[2], velocity[2]
    for start, pose in ((FEET, LEFT_POSE), (FEET + 6, RIGHT_POSE)):
        for i in range(3):
            out[start + i] = poses[pose + 4 * i + 3]
        down, across, up = poses[pose + 8], poses[pose + 9], poses[pose + 10]  # the last row of the rotation
        out[start + 3] = math.atan2(across, up)
        out[start + 4] = math.atan2(-down, math.hypot(across, up))
        out[start + 5] = math.atan2(poses[pose + 4], poses[pose])


@compiled
def write_step(motion: np.ndarray, tick: float, step: np.ndarray) -> None:
    """The displacement v δ + v̇ δ²/2 + v⃛ δ³/6 of the coming tick, shape of v, if v̇ goes on changing as it did last.

    Args:
        motion: q, v, v̇ and the v̇ before, one behind the other. tick: δ [s].
    """
    n = len(step)
    first = len(motion) - 3 * n
    for i in range(n):
        v, vdot, before = motion[first + i], motion[first + n + i], motion[first + 2 * n + i]
        step[i] = tick * (v + tick * (vdot / 2.0 + (vdot - before) / 6.0))


@compiled
def write_motion(
    q: np.ndarray, v: np.ndarray, vdot: np.ndarray, last: np.ndarray, joints: np.ndarray, tick: float, tau: np.ndarray,
    zmp: tuple[float, float], status: tuple[bool, float, int], out: np.ndarray,
) -> None:  # fmt: skip
    """desired_state, feedforward, whole_body_zmp and ik_status, then the state of `InverseKinematics` to come.

    The joints' targets are their angles in q, their rates the constant ones that lead there from the last tick's. The
    state is q, v, v̇ and the last v̇; where the target is not met, q and zeros.

    Args:
        last: the present state. joints: places of the joints in q (n,). tick: δ [s]. tau: torques (n,).
        status: met, greatest error, iterations.
    """
    count, positions, n = len(joints), len(q), len(v)
    for i in range(count):
        out[i] = q[joints[i]]
        out[count + i] = (q[joints[i]] - last[joints[i]]) / tick
        out[2 * count + i] = tau[i]
    start = 3 * count
    out[start], out[start + 1] = zmp
    out[start + 2], out[start + 3], out[start + 4] = status[0], status[1], status[2]
    start += 5
    for i in range(positions):
        out[start + i] = q[i]
    start += positions
    for i in range(n):
        out[start + i], out[start + n + i], out[start + 2 * n + i] = 0.0, 0.0, 0.0
        if status[0]:
            out[start + i], out[start + n + i], out[start + 2 * n + i] = v[i], vdot[i], last[positions + n + i]


@compiled
def write_wanted(com: np.ndarray, height: np.ndarray, feet: np.ndarray, wanted: np.ndarray) -> None:
    """Place, velocity and acceleration in task coordinates, (3, 18), but for the rotations, which stay as they are.

    From com_reference (6,), com_height (3,) and foot_reference (18,).
    """
    for order in range(3):
        wanted[order, COM], wanted[order, COM + 1], wanted[order, COM + 2] = com[order], com[3 + order], height[order]
        for axis in range(3):
            wanted[order, LEFT + axis] = feet[AXES * order + axis]
            wanted[order, RIGHT + axis] = feet[FOOT + AXES * order + axis]


@compiled
def write_table_offset(phase: int, side: np.ndarray, table: np.ndarray, out: np.ndarray) -> None:
    """The learned ZMP offset of the coming ticks, (2, H): of the table in x, of ± the table in y, none in a stand.

    Args:
        phase: the present tick of the step. side: the stance foot at each coming tick, +1 left, −1 right, 0 both (H,).
        table: offset in x, then in y, at each tick of a step on the left foot (2 N,) [m].
    """
    period = len(table) // 2
    place = phase % period
    for i in range(len(side)):
        place = place + 1 if place + 1 < period else 0  # a division takes longer than all else here
        out[0, i] = table[place] * abs(side[i])
        out[1, i] = table[period + place] * side[i]


@compiled
def update_table(
    phase: int, support: float, zmp: np.ndarray, planned: np.ndarray, feet: np.ndarray, lever: tuple[float, float],
    most: float, table: np.ndarray,
) -> None:  # fmt: skip
    """Moves the table's entries of this tick towards the ZMP offset, less the part that the swing foot explains.

    An offset that is NaN or infinite leaves the table as it is.

    Args:
        phase: tick of the step. support: the stance foot, +1 left, −1 right.
        zmp: whole_body_zmp (2,). planned: zmp_reference (4,). feet: foot_reference (18,). table: as above.
        lever: ZMP displacement per unit of the swing foot's acceleration [s²].
        most: largest offset that is learned [m].
    """
    period = len(table) // 2
    swing = (FOOT if support > 0.0 else 0) + ACCELERATION
    x = zmp[0] - planned[0] - lever[0] * feet[swing]
    y = (zmp[1] - planned[2] - lever[1] * feet[swing + 1]) * support
    if math.isfinite(x) and math.isfinite(y):
        table[phase] += LEARNING_RATE * (min(max(x, -most), most) - table[phase])
        table[period + phase] += LEARNING_RATE * (min(max(y, -most), most) - table[period + phase])


@compiled
def learn_bias(
    memory: np.ndarray, joints: np.ndarray, leg: int, applied: np.ndarray, feedforward: np.ndarray, gain: float,
    most: float, shift: tuple[float, float],
) -> None:  # fmt: skip
    """Moves a leg's bias towards what its PD adds to the feedforward, and the left leg's share of the load; see
    `TorqueBias`.

    An error of the bias that is longer than `most` counts as that long; one that is not finite changes nothing.

    Args:
        memory: bias of the left, then the right leg, and the share (2 n + 1,). joints: of a leg that have a bias.
        leg: the one that stands, 0 left, 1 right, −1 where nothing is learned.
        applied, feedforward: torques of both legs (2 n,) [N m].
        gain: share of the error by which the bias moves. shift: where the share goes, and how far in a tick at most.
    """
    last = len(memory) - 1
    goal, step = shift
    memory[last] += min(max(goal - memory[last], -step), step)
    if leg < 0:
        return
    start, square = leg * (last // 2), 0.0
    for j in joints:
        square += (applied[start + j] - feedforward[start + j] - memory[start + j]) ** 2
    if math.isfinite(square) and square > 0.0:
        factor = gain * min(1.0, most / math.sqrt(square))
        for j in joints:
            memory[start + j] += factor * (applied[start + j] - feedforward[start + j] - memory[start + j])


@compiled
def write_sent_torque(
    memory: np.ndarray, feedforward: np.ndarray, band: float, limits: np.ndarray, out: np.ndarray
) -> None:
    """torque_bias, then sent_torque: of each leg's bias b its share of clip(|b|/band − 1, 0, 1) b; see `TorqueBias`.

    What is sent is within the joints' limits where the feedforward is, and no farther beyond them where it is not.

    Args:
        memory: as in `learn_bias` (2 n + 1,). feedforward, limits: (2 n,) [N m]. band: [N m].
    """
    both = len(feedforward)
    count, left = both // 2, memory[both]
    for leg in range(2):
        square = 0.0
        for i in range(leg * count, (leg + 1) * count):
            square += memory[i] ** 2
        share = left if leg == 0 else 1.0 - left
        factor = share * min(max(math.sqrt(square) / band - 1.0, 0.0), 1.0)
        for i in range(leg * count, (leg + 1) * count):
            most = max(limits[i], abs(feedforward[i]))
            out[i] = min(max(factor * memory[i], -most - feedforward[i]), most - feedforward[i])
            out[both + i] = feedforward[i] + out[i]
