"""The input nearest to a wanted one under rows that need not all be possible: those that can be kept are kept exactly.

Rows a_i·u ≥ b_i in an order of priority, within limits that always hold:

1. A row is kept if some input satisfies it together with the limits and all rows of higher priority that are kept.
2. Each other row, in the same order, is missed by as little as the limits, the kept rows and the rows before allow.
3. Of the inputs that are left, the one nearest to the wanted one is taken.

So a row that is out of reach costs no row that is within reach, whatever their order.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.barriers.projection import Array, project

_MARGIN = 1e-13  # by which a bound stays below its supremum, as a share of the terms that it is the sum of


class Kept(NamedTuple):
    """The answer of `nearest_kept`.

    Attributes:
        input: u, (n_u,).
        missed: by how much each row is missed, ≥ 0, (r,) [unit of its b]; 0 for rows that are kept.
    """

    input: Array
    missed: Array


def nearest_kept(
    target: Array, A: Array, b: Array, rounding: Array, limits: tuple[Array, Array], order: Sequence[int]
) -> Kept | None:
    """The input of this module's three rules; None where the iterations of `project` did not suffice.

    Args:
        target: the wanted input, (n_u,).
        A: rows of length 1, (r, n_u).
        b: (r,).
        rounding: rows that are missed by no more than this count as kept, (r,) [unit of b].
        limits: further rows and their bounds, which hold for some input.
        order: the indices of the rows, the most important one first.
    """
    rows, bounds = np.vstack([A, limits[0]]), np.concatenate([b, limits[1]])
    found = project(target, rows, bounds)
    if found.point is not None:
        return Kept(found.point, np.zeros(len(b)))
    used = np.arange(len(bounds)) >= len(b)
    lost = []
    for i in order:
        used[i] = True
        if not _lower(i, target, rows, bounds, used, rounding[i]):
            used[i] = False
            lost.append(i)
    for i in lost:
        used[i] = True
        used[i] = _lower(i, target, rows, bounds, used, np.inf)
    found = project(target, rows[used], bounds[used])
    missed = np.where(np.isin(np.arange(len(b)), lost), np.maximum(b - bounds[: len(b)], 0.0), 0.0)
    return None if found.point is None else Kept(found.point, missed)


def _lower(i: int, target: Array, rows: Array, bounds: Array, used: Array, most: float) -> bool:
    """Lowers bound i until some input satisfies all used rows, but by `most` at most; whether that was enough.

    Each proof that there is no such input, Σ y_j a_j = 0 with Σ y_j b_j > 0, bounds a_i·u from above by
    −Σ_{j≠i} y_j b_j / y_i. The bound falls with each of them to the next value of finitely many.
    """
    wanted, places = bounds[i], np.flatnonzero(used)
    for _ in range(10 * (len(places) + 2)):
        found = project(target, rows[used], bounds[used])
        if found.point is not None:
            return True
        if found.proof is None:
            break
        terms = found.proof * bounds[used]
        own = int(np.searchsorted(places, i))
        share = found.proof[own]
        if share == 0.0:  # the others exclude each other by rounding
            break
        terms[own] = 0.0
        highest = -(float(terms.sum()) + _MARGIN * float(np.abs(terms).sum())) / share
        highest = min(highest, np.nextafter(bounds[i], -np.inf))
        if not wanted - highest <= most:
            break
        bounds[i] = highest
    bounds[i] = wanted
    return False
