"""Finds the slack variables of a compiled program: those that do nothing but soften one row each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.qp.compiled import ParametricQp


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
    priced = np.flatnonzero((np.count_nonzero(qp.P, axis=1) == 1) & (np.diag(qp.P) > 0.0) & ~qp.linear.changing)
    used = qp.A != 0.0
    alone = np.count_nonzero(used, axis=1) == 1
    used = used[:, priced]
    once = (np.count_nonzero(used[alone], axis=0) == 1) & (np.count_nonzero(used[~alone], axis=0) == 1)
    columns, used = priced[once], used[:, once]
    bounds = (used & alone[:, None]).argmax(axis=0)
    rows = (used & ~alone[:, None]).argmax(axis=0)
    from_zero = (
        (qp.A[bounds, columns] == 1.0)
        & (qp.lower.offset[bounds] == 0.0)
        & ~qp.lower.changing[bounds]
        & np.isposinf(qp.upper.offset[bounds])
    )
    one_sided = (qp.A[rows, columns] == 1.0) & np.isposinf(qp.upper.offset[rows])
    chosen = from_zero & one_sided
    # A row with two slacks keeps the first; the other one stays an ordinary decision.
    first = np.zeros(len(columns), dtype=bool)
    first[np.flatnonzero(chosen)[np.unique(rows[chosen], return_index=True)[1]]] = True
    columns, rows, bounds = columns[first], rows[first], bounds[first]
    return Slacks(columns, rows, bounds, qp.linear.offset[columns], qp.P[columns, columns])
