"""Finds the slack variables of a compiled program: those that do nothing but soften one row each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.compiled import ParametricQp


class Slacks(NamedTuple):
    """Slacks s ≥ 0 in rows  a·w + s ≥ l(θ)  with cost  linear·s + ½ quadratic·s².

    Attributes:
        columns: the slacks among the decisions. rows: the row that each softens. bounds: its row s ≥ 0.
        linear, quadratic: its price.
    """

    columns: np.ndarray
    rows: np.ndarray
    bounds: np.ndarray
    linear: np.ndarray
    quadratic: np.ndarray


def find_slacks(qp: ParametricQp) -> Slacks:
    """All slacks of that form; anything that differs (two rows, a coupled cost) is an ordinary decision."""
    found: list[tuple[int, int, int]] = []
    used = qp.A != 0.0
    alone = used.sum(axis=1) == 1
    for column in range(len(qp.q)):
        rows = np.flatnonzero(used[:, column])
        if len(rows) != 2:
            continue
        bounds = rows[alone[rows]]
        softened = rows[~alone[rows]]
        if len(bounds) != 1 or len(softened) != 1:
            continue
        bound, row = int(bounds[0]), int(softened[0])
        coupled = np.count_nonzero(qp.P[column]) > 1 or np.any(qp.Q[column] != 0.0)
        from_zero = (
            qp.A[bound, column] == 1.0
            and qp.lower[bound] == 0.0
            and not np.any(qp.lower_map[bound])
            and np.isposinf(qp.upper[bound])
        )
        one_sided = qp.A[row, column] == 1.0 and np.isposinf(qp.upper[row])
        if from_zero and one_sided and not coupled and qp.P[column, column] > 0.0:
            found.append((column, row, bound))
    columns, rows, bounds = (np.array([entry[i] for entry in found], dtype=int) for i in range(3))
    return Slacks(columns, rows, bounds, qp.q[columns], qp.P[columns, columns])
