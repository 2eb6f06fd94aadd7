"""Rows of a compiled program that say something of the same combination of decisions, as one row with both bounds."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.qp.affine_map import AffineMap


def merged_rows(
    rows: np.ndarray, low: np.ndarray, high: np.ndarray, names: list[str], n: int
) -> tuple[np.ndarray, AffineMap, AffineMap, list[str]]:
    """One row for all rows with the same, or the opposite, decision part; each bound is an affine map of θ.

    Two different lower bounds on one row can't be merged into an affine one and stay two rows.
    """
    group, turn = _equal_rows(rows[:, :n])
    rows[turn] *= -1.0
    low, high = np.where(turn, -high, low), np.where(turn, -low, high)
    merged = np.empty((len(rows), 3), dtype=int)
    at, lower, upper = merged[: _share(group, np.isfinite(low), np.isfinite(high), merged)].T
    # l ≤ a·w + t·θ ≤ u   ⇔   l − t·θ ≤ a·w ≤ u − t·θ
    return (
        rows[at, :n] + 0.0,
        _bound(low, rows, n, lower, -np.inf),
        _bound(high, rows, n, upper, np.inf),
        [names[i] for i in at],
    )


@compiled
def _share(group: np.ndarray, has_low: np.ndarray, has_high: np.ndarray, merged: np.ndarray) -> int:
    """Merges rows: each joins the first merged row of its group that lacks the bounds it has; gives how many there are.

    Fills in, for each merged row, the row that it is first seen in, that of its lower bound and that of its upper
    bound, or −1.
    """
    count = 0
    for i in range(len(group)):
        entry = 0
        while entry < count and (
            group[merged[entry, 0]] != group[i]
            or (has_low[i] and merged[entry, 1] >= 0)
            or (has_high[i] and merged[entry, 2] >= 0)
        ):
            entry += 1
        if entry == count:
            merged[entry, 0], merged[entry, 1], merged[entry, 2] = i, -1, -1
            count += 1
        if has_low[i]:
            merged[entry, 1] = i
        if has_high[i]:
            merged[entry, 2] = i
    return count


def _equal_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each row the first one that equals it or its opposite, and whether it is the opposite."""
    # Equal rows have equal sums and opposite ones opposite sums, to the last bit, whatever the weights: `einsum` adds
    # up each row in the same order, where a matrix product need not.
    sums = np.einsum("ij,j->i", rows, somewhere(rows.shape[1]))
    _, first, inverse = np.unique(np.abs(sums), return_index=True, return_inverse=True)
    group = first[inverse]
    others = np.flatnonzero(group != np.arange(len(rows)))
    sign = np.where(sums[others] == sums[group[others]], 1.0, -1.0)
    alike = (sign[:, None] * rows[others] == rows[group[others]]).all(axis=1)
    group[others[~alike]] = others[~alike]
    turn = np.zeros(len(rows), dtype=bool)
    turn[others] = alike & (sign < 0.0)
    return group, turn


def _bound(values: np.ndarray, rows: np.ndarray, n: int, of: np.ndarray, none: float) -> AffineMap:
    """The bound of each merged row, taken from row `of`; −1 stands for no bound."""
    matrix = -rows[of, n:]
    matrix[of < 0] = 0.0
    return AffineMap(np.append(values, none)[of], matrix)


@lru_cache(maxsize=16)
def somewhere(count: int) -> np.ndarray:
    """A point (count,) where two linear functions that differ are not equal by chance; do not write into it."""
    return np.random.default_rng(0).uniform(1.0, 2.0, count)
