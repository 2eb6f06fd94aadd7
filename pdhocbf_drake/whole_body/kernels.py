"""What a planned motion uses of the limits of joints and soles, as machine code.

`tests/test_whole_body.py` compares the kernels with numpy.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from pdhocbf_drake.jit import compiled

Limits: TypeAlias = tuple[Any, ...]
"""Torques that the plan may use (12,), most by which one may change in a tick, places of the joints in q and v,
coefficients, lower, upper and speed of `write_interval`, and of the soles' limits the rows (2, 15, 6), low and high."""

JOINTS, PER_SOLE, WRENCH = 12, 15, 6
AWAY, PLACE, RATE, LAST, ERROR, TABLE = 0, 1, 19, 37, 49, 61
"""Where parts of the memory's vector begin, see `BodyMemory`."""
CENTRE = (9, 13)
"""Rows of a sole that are its centre of pressure's, first and last + 1."""
PERSISTS = 0.5  # share of the last error that the next tick is predicted to have
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
def write_sole(wrench: np.ndarray, pose: int, poses: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
    """The limits' rows (n, 6) times force and moment on a sole (6,), turned into its axes."""
    for i in range(len(rows)):
        out[i] = 0.0
        for axis in range(3):
            force = moment = 0.0
            for r in range(3):
                turn = poses[pose + 4 * r + axis]
                force += turn * wrench[r]
                moment += turn * wrench[3 + r]
            out[i] += rows[i, axis] * force + rows[i, 3 + axis] * moment


@compiled
def write_use(
    tau: np.ndarray, left: np.ndarray, right: np.ndarray, q: np.ndarray, v: np.ndarray, vdot: np.ndarray,
    memory: np.ndarray, tick: int, poses: np.ndarray, share: float, limits: Limits, use: np.ndarray, low: np.ndarray,
    high: np.ndarray,
) -> tuple[int, float, float, float]:  # fmt: skip
    """What a motion uses of each limit, and the limits (n,).

    First the joints' torques over what the plan may use, then their accelerations [rad/s²], then the rows of each sole
    that carries load. A centre of pressure beyond an edge is its own limit: no motion brings it back inside, but none
    may take it farther out.

    Args:
        tau: torques of the joints (12,) [N m]. left, right: wrenches on the soles (6,). q, v, vdot: of all joints.
        memory: see `BodyMemory`. tick: of the gait.
        poses: see `robot.task_space`. share: of the load, on the left sole.
    """
    usable, change, joints, places, coefficients, lower, upper, speed, rows, rows_low, rows_high = limits
    worst = stopped = outside = -np.inf
    for i in range(JOINTS):
        added = memory[TABLE + JOINTS * tick + i] + PERSISTS * memory[ERROR + i]
        use[i], use[JOINTS + i] = (tau[i] + added) / usable[i], vdot[places[i]]
        low[i] = min(max((memory[LAST + i] - change + added) / usable[i], -1.0), 1.0)
        high[i] = max(min((memory[LAST + i] + change + added) / usable[i], 1.0), -1.0)
        write_interval(
            q[joints[i] : joints[i] + 1], v[places[i] : places[i] + 1], coefficients, lower[i : i + 1],
            upper[i : i + 1], speed[i : i + 1], low[JOINTS + i : JOINTS + i + 1], high[JOINTS + i : JOINTS + i + 1],
        )  # fmt: skip
        of_speed = abs(vdot[places[i]] - coefficients[3] * v[places[i]]) - coefficients[4] * speed[i]
        worst = max(worst, max(max(low[i] - use[i], use[i] - high[i]), of_speed))
        stopped = max(stopped, max(low[JOINTS + i] - use[JOINTS + i], use[JOINTS + i] - high[JOINTS + i]))
    count = 2 * JOINTS
    for sole in range(2):
        if (share if sole == 0 else 1.0 - share) > 0.0:
            wrench = left if sole == 0 else right
            write_sole(wrench, _SOLE_POSES[sole], poses, rows[sole], use[count : count + PER_SOLE])
            for i in range(PER_SOLE):
                low[count + i], high[count + i] = rows_low[i], rows_high[i]
            for i in range(count + CENTRE[0], count + CENTRE[1]):
                outside = max(outside, max(low[i] - use[i], use[i] - high[i]))
                low[i], high[i] = min(low[i], use[i]), max(high[i], use[i])
            count += PER_SOLE
    for i in range(2 * JOINTS, count):
        worst = max(worst, max(low[i] - use[i], use[i] - high[i]))
    return count, worst, stopped, outside


@compiled
def passes(
    tau: np.ndarray, left: np.ndarray, right: np.ndarray, last: np.ndarray, q: np.ndarray, v: np.ndarray,
    vdot: np.ndarray, memory: np.ndarray, tick: int, poses: np.ndarray, share: float, limits: Limits,
    effort: np.ndarray, step: np.ndarray, exceeded: float, use: np.ndarray, low: np.ndarray, high: np.ndarray,
    out: np.ndarray,
) -> bool:  # fmt: skip
    """Whether a motion without deviation keeps all limits; if so, the memory a tick later is written into `out`.

    Args:
        last: q of the last tick. effort: of the joints (12,) [N m]. step: most that they move in a tick (12,) [rad].
        exceeded: by how much a limit may be exceeded.
    """
    _, worst, stopped, outside = write_use(
        tau, left, right, q, v, vdot, memory, tick, poses, share, limits, use, low, high
    )
    joints = limits[2]
    inside = max(worst, max(stopped, outside)) <= exceeded
    for i in range(JOINTS):
        inside = inside and abs(tau[i]) <= effort[i] and abs(q[joints[i]] - last[joints[i]]) <= step[i]
    if inside:
        for i in range(len(memory)):
            out[i] = memory[i]
        for i in range(JOINTS):
            out[LAST + i] = tau[i]
    return inside


@compiled
def learn(memory: np.ndarray, tick: int, applied: np.ndarray, feedforward: np.ndarray, stands: bool) -> None:
    """Writes what the PD added at a tick of the gait, applied less feedforward torques (12,), unless it is not finite.

    The memory's error becomes its difference from what was remembered of that tick. Ticks behind it that no gait has
    shown, those with the same value as it had, are taken to have the new one; in a stand all are.
    """
    start, ticks = TABLE + JOINTS * tick, (len(memory) - TABLE) // JOINTS
    for i in range(JOINTS):
        added, before = applied[i] - feedforward[i], memory[start + i]
        if not np.isfinite(added):
            continue
        memory[ERROR + i], memory[start + i] = added - before, added
        for n in range(0 if stands else tick + 1, ticks):
            if not stands and memory[TABLE + JOINTS * n + i] != before:
                break
            memory[TABLE + JOINTS * n + i] = added


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
