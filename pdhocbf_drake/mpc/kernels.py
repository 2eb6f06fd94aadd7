"""The arithmetic of a tick outside of its quadratic program, as machine code."""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.jit import compiled


@compiled
def believe(
    planned: np.ndarray, measured: np.ndarray, before: np.ndarray, zmp_measured: bool, latency: float, eta: float,
    state: np.ndarray, com: np.ndarray,
) -> tuple[bool, bool, float]:  # fmt: skip
    """Fills in the state `latency` after the measurement, and the measured c and v of both axes.

    Gives whether all is finite, whether c and v equal those of `before`, and by how much they differ from the plan.
    """
    finite, repeats, moves = True, True, 0.0
    for axis in range(2):
        c, v = measured[axis, 0], measured[axis, 1]
        p = measured[axis, 2] if zmp_measured else planned[axis, 2]
        finite = finite and math.isfinite(c) and math.isfinite(v) and math.isfinite(p)
        repeats = repeats and c == before[2 * axis] and v == before[2 * axis + 1]
        moves = max(moves, abs(planned[axis, 0] - c), abs(planned[axis, 1] - v))
        com[2 * axis], com[2 * axis + 1] = c, v
        state[axis, 0], state[axis, 1], state[axis, 2] = c + latency * v, v + latency * eta * (c - p), p
    return finite, repeats, moves


@compiled
def write_common(
    of_step: np.ndarray, axis: int, state: np.ndarray, stance: np.ndarray, offset: np.ndarray, theta: np.ndarray
) -> None:
    """θ of an axis from what holds all through the step, and at its start [c, v, p], stance (2,) and ZMP offset (H,).

    Args:
        state: (2, 3). stance: (2, 2). offset: (2, H), or (2, 0) for none.
    """
    for i in range(len(theta)):
        theta[i] = of_step[i]
    for i in range(3):
        theta[i] = state[axis, i]
    for i in range(2):
        theta[3 + i] = stance[axis, i]
    for i in range(offset.shape[1]):
        theta[5 + i] = offset[axis, i]


@compiled
def write_plan(
    x: np.ndarray, y: np.ndarray, starts_x: np.ndarray, starts_y: np.ndarray, rows_x: np.ndarray, rows_y: np.ndarray,
    active_x: np.ndarray, active_y: np.ndarray, noticed: float, inputs: np.ndarray, footholds: np.ndarray,
    slacks: np.ndarray, acting: np.ndarray,
) -> float:  # fmt: skip
    """Fills in a plan from the decisions of both axes, [inputs, footholds, slacks], and from the active rows.

    Args:
        x, y: the decisions. starts_x, starts_y: where the slacks of each barrier begin among all slacks.
        rows_x, rows_y: 1 where a row of the axis' own program is one of a barrier, (n_b, m).
        active_x, active_y: flags of the rows of the program that was solved, 0 if inactive.
        noticed: least slack that counts.
        inputs: (2, H). footholds: (2, n_f).
        slacks: the largest one of each barrier, those of x, then those of y; 0 where there are none.
        acting: 1 for each barrier with an active row, in the same order, else 0; on a lower rung, whose program has
            another number of rows, for those with a slack that counts.

    Returns:
        The largest of all slacks, at least 0.
    """
    horizon, count = inputs.shape[1], inputs.shape[1] + footholds.shape[1]
    largest, place = 0.0, 0
    for axis in range(2):
        decisions, starts = (x, starts_x) if axis == 0 else (y, starts_y)
        rows, active = (rows_x, active_x) if axis == 0 else (rows_y, active_y)
        for i in range(horizon):
            inputs[axis, i] = decisions[i]
        for i in range(horizon, count):
            footholds[axis, i - horizon] = decisions[i]
        for i in range(len(starts)):
            start = count + starts[i]
            stop = min(count + starts[i + 1], len(decisions)) if i + 1 < len(starts) else len(decisions)
            slacks[place] = decisions[start] if start < stop else 0.0
            for j in range(start, stop):
                slacks[place] = max(slacks[place], decisions[j])
            largest = max(largest, slacks[place])
            acting[place] = 1.0 if slacks[place] > noticed else 0.0
            if rows.shape[1] == len(active):
                acting[place] = 0.0
                for j in range(len(active)):
                    if rows[i, j] != 0.0 and active[j] != 0.0:
                        acting[place] = 1.0
            place += 1
    return largest


@compiled
def same_bits(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two vectors of one length are the same bit for bit, as NaN is then equal to itself."""
    a, b, differing = one.view(np.int64), other.view(np.int64), 0
    for i in range(len(a)):
        differing |= a[i] ^ b[i]
    return differing == 0


@compiled
def carry_forward(A: np.ndarray, B: np.ndarray, tick: int, sent: np.ndarray, state: np.ndarray) -> None:
    """Moves a state of tick k − d on to tick k, in place: s(j + 1) = A(j) s(j) + B(j) u(j).

    Args:
        A, B: of the template over one period, (N, 3, 3) and (N, 3).
        tick: k − d.
        sent: ZMP velocities u(k − d) … u(k − 1) of x and y, (2, d) [m/s].
        state: c, v, p of x, then of y, (2, 3) [m, m/s, m].
    """
    for j in range(sent.shape[1]):
        phase = (tick + j) % len(A)
        a, b = A[phase], B[phase]
        for axis in range(2):
            c, v, p, u = state[axis, 0], state[axis, 1], state[axis, 2], sent[axis, j]
            for row in range(3):
                state[axis, row] = a[row, 0] * c + a[row, 1] * v + a[row, 2] * p + b[row] * u


@compiled
def write_disturbance(
    gain: float, fastest: float, most: float, band: float, tick: float, w: np.ndarray,
    error: tuple[float, float], acted: np.ndarray, after: np.ndarray,
) -> None:  # fmt: skip
    """Writes what `cancelling.estimated` returns into `after` (4,); `fastest`: the estimate's longest step [m/s²]."""
    for i in range(4):
        after[i] = w[i]
    x = gain * (error[0] / tick + acted[0] - w[0])
    y = gain * (error[1] / tick + acted[1] - w[1])
    length = math.hypot(x, y)
    if not math.isfinite(length):
        return
    share = fastest / length if length > fastest else 1.0
    x, y = w[0] + share * x, w[1] + share * y
    length = math.hypot(x, y)
    share = most / length if length > most else 1.0
    after[0], after[1] = share * x, share * y
    x, y = after[0] - w[2], after[1] - w[3]
    length = math.hypot(x, y)
    if length > band:
        after[2], after[3] = w[2] + x * (1.0 - band / length), w[3] + y * (1.0 - band / length)
    elif math.hypot(after[0], after[1]) < band:
        after[2], after[3] = (1.0 - gain) * w[2], (1.0 - gain) * w[3]


@compiled
def write_sent(
    w: np.ndarray, eta: float, ahead: float, tick: float, velocity: np.ndarray, before: np.ndarray, com: np.ndarray,
    zmp: np.ndarray, shift: np.ndarray,
) -> None:  # fmt: skip
    """Turns com_reference (6,) and zmp_reference (4,) from planned to sent ones, and fills in the ZMP's shift (2,).

    Args:
        w: estimated disturbance, then what is cancelled of it, (4,) [m/s²]. eta: of the tick [1/s²].
        ahead: by how long what is sent leads the planned ZMP, whose velocity is `velocity` (2,) [s, m/s].
        tick: δ [s]. before: the ZMP's shift a tick earlier (2,) [m].
    """
    for axis in range(2):
        shift[axis] = w[2 + axis] / eta + ahead * velocity[axis]
        com[3 * axis + 2] -= eta * shift[axis]
        zmp[2 * axis] += shift[axis]
        zmp[2 * axis + 1] += (shift[axis] - before[axis]) / tick


@compiled
def write_cancelling(w: np.ndarray, eta: np.ndarray, first: int, given: np.ndarray, offset: np.ndarray) -> None:
    """Writes the `given` offset (2, H) with the ZMP's way w/eta that cancels a disturbance at ticks `first` … [m].

    Args:
        w: estimated disturbance, then what is cancelled of it, (4,) [m/s²]. eta: over one period, (N,) [1/s²].
    """
    phase = first % len(eta)
    for i in range(offset.shape[1]):
        at = eta[phase]
        offset[0, i] = given[0, i] + w[2] / at
        offset[1, i] = given[1, i] + w[3] / at
        phase = phase + 1 if phase + 1 < len(eta) else 0
