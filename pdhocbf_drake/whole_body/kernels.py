"""What a planned motion uses of the limits of joints and soles, as machine code.

`tests/test_whole_body.py` compares the kernels with numpy.
"""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.jit import compiled

JOINTS, PER_SOLE, WRENCH = 12, 11, 6
_SOLE_POSES = (15, 27)  # in poses (39,), see `robot.task_space`


@compiled
def write_interval(
    q: np.ndarray, v: np.ndarray, coefficients: tuple[float, float, float, float, float], lower: np.ndarray,
    upper: np.ndarray, speed: np.ndarray, low: np.ndarray, high: np.ndarray,
) -> None:  # fmt: skip
    """Least and largest accelerations (n,) of joints at angles q and speeds v (n,), see `JointBarriers`."""
    on_angle, on_speed, on_limit, coasting, on_most = coefficients
    for i in range(len(q)):
        free = on_angle * q[i] + on_speed * v[i]
        least, most = free + on_limit * lower[i], free + on_limit * upper[i]
        low[i] = min(max(coasting * v[i] - on_most * speed[i], least), most)
        high[i] = min(max(coasting * v[i] + on_most * speed[i], least), most)


@compiled
def write_sole(wrench: np.ndarray, first: int, pose: int, poses: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
    """The limits' rows (n, 6) times force and moment on a sole, wrench[first:first + 6], turned into its axes."""
    for i in range(len(rows)):
        out[i] = 0.0
        for axis in range(3):
            force = moment = 0.0
            for r in range(3):
                turn = poses[pose + 4 * r + axis]
                force += turn * wrench[first + r]
                moment += turn * wrench[first + 3 + r]
            out[i] += rows[i, axis] * force + rows[i, 3 + axis] * moment


@compiled
def write_use(
    tau: np.ndarray, wrenches: np.ndarray, angles: np.ndarray, speeds: np.ndarray, accelerations: np.ndarray,
    added: np.ndarray, last: np.ndarray, change: float, effort: np.ndarray,
    coefficients: tuple[float, float, float, float, float], lower: np.ndarray, upper: np.ndarray, speed: np.ndarray,
    poses: np.ndarray, share: float, rows: np.ndarray, rows_low: np.ndarray, rows_high: np.ndarray, use: np.ndarray,
    low: np.ndarray, high: np.ndarray,
) -> tuple[int, float]:  # fmt: skip
    """What a motion uses of each limit, and the limits (n,); n, and by how much it exceeds one.

    First the joints' torques over their limits, then their accelerations [rad/s²], then the rows of each sole that
    carries load.

    Args:
        tau, angles, speeds, accelerations: of the joints (12,). wrenches: on the left, then the right sole (12,).
        added, last: torque that the joints' PD adds, and the tau of the last tick (12,) [N m].
        change: most that a torque may change by in a tick [N m]. effort: limits (12,) [N m].
        coefficients, lower, upper, speed: see `write_interval`.
        poses: see `robot.task_space`. share: of the load, on the left sole.
        rows, rows_low, rows_high: limits of the left and of the right sole, (2, 11, 6), (11,), (11,).
    """
    write_interval(angles, speeds, coefficients, lower, upper, speed, low[JOINTS:], high[JOINTS:])
    for i in range(JOINTS):
        use[i], use[JOINTS + i] = (tau[i] + added[i]) / effort[i], accelerations[i]
        low[i] = min(max((last[i] - change + added[i]) / effort[i], -1.0), 1.0)
        high[i] = max(min((last[i] + change + added[i]) / effort[i], 1.0), -1.0)
    count = 2 * JOINTS
    for sole in range(2):
        if (share if sole == 0 else 1.0 - share) > 0.0:
            write_sole(wrenches, WRENCH * sole, _SOLE_POSES[sole], poses, rows[sole], use[count : count + PER_SOLE])
            for i in range(PER_SOLE):
                low[count + i], high[count + i] = rows_low[i], rows_high[i]
            count += PER_SOLE
    worst = -np.inf
    for i in range(count):
        worst = max(worst, max(low[i] - use[i], use[i] - high[i]))
    return count, worst


@compiled
def limit_step(last: np.ndarray, most: np.ndarray, joints: np.ndarray, q: np.ndarray) -> float:
    """Moves joints, at their places in q, to within ± most of their last angles; the largest share beyond that.

    Args:
        last: angles of a tick ago, in q's order. most: (n,) [rad]. joints: (n,).
    """
    beyond = 0.0
    for i in range(len(joints)):
        step = q[joints[i]] - last[joints[i]]
        if abs(step) > most[i]:
            beyond = max(beyond, abs(step) / most[i] - 1.0)
            q[joints[i]] = last[joints[i]] + (most[i] if step > 0.0 else -most[i])
    return beyond
