"""Small linear programs, exact to rounding in any units, by the proofs of `project`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.barriers.priorities import nearest_kept
from pdhocbf_drake.barriers.projection import project

Array = NDArray[np.float64]

_FAR = 1e12  # what is larger than the offsets of the rows by this factor is unbounded


class Minimum(NamedTuple):
    """The least value and a point that has it, (n,); −∞ and a far point where it is unbounded."""

    value: float
    point: Array


def minimum(cost: Array, rows: Array) -> Minimum | None:
    """min_x cost·[1, x] subject to rows·[1, x] ≥ 0; None where no x satisfies the rows.

    The rows are divided by their lengths, and each x_j by the mean ratio of offset and slope, so that common factors on
    the rows, on the cost, or on any x_j change nothing else.

    Args:
        cost: (1 + n,).
        rows: (r, 1 + n).
    """
    unit = _unit(rows)
    slopes, offsets = rows[:, 1:] * unit, rows[:, 0]
    length = np.linalg.norm(slopes, axis=1)
    fixed = length == 0
    if np.any(offsets[fixed] < 0):
        return None
    slopes, bounds = slopes[~fixed] / length[~fixed, None], -offsets[~fixed] / length[~fixed]
    start, goal = np.zeros(rows.shape[1] - 1), -cost[1:] * unit
    size = float(np.linalg.norm(goal))
    inside = project(start, slopes, bounds).point
    if inside is None:
        return None
    if size > 0:
        far = _FAR * (1.0 + np.abs(bounds).max(initial=0.0) + np.abs(inside).max())
        found = nearest_kept(start, goal[None] / size, np.array([far]), (slopes, bounds), [0], lambda: np.full(1, 0.0))
        if found is not None and not found.lost:
            return Minimum(-np.inf, found.input * unit)
        inside = inside if found is None else found.input
    return Minimum(float(cost[0] + cost[1:] @ (inside * unit)), inside * unit)


def _unit(rows: Array) -> Array:
    """For each x_j the geometric mean of |offset/slope| over the rows that have both; 1 where none has."""
    offsets, slopes = np.abs(rows[:, :1]), np.abs(rows[:, 1:])
    both = (offsets > 0) & (slopes > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.where(both, np.log2(offsets) - np.log2(slopes), 0.0)
    count = both.sum(axis=0)
    return np.asarray(2.0 ** np.round(logs.sum(axis=0) / np.maximum(count, 1)))  # powers of two change no digit
