"""The input nearest to a wanted one under rows that need not all be possible: those that can be kept are kept exactly.

Rows a_i·u ≥ b_i in an order of priority, within limits that always hold:

1. A row is kept if some input satisfies it together with the limits and all rows of higher priority that are kept.
2. Each other row, in the same order, is missed by as little as the limits, the kept rows and the rows before allow.
3. Of the inputs that are left, the one nearest to the wanted one is taken.

So a row that is out of reach costs no row that is within reach, whatever their order.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdhocbf_drake.barriers.projection import Array, Projection, project

_MARGIN = 1e-13  # by which a bound stays below its supremum, as a share of the terms that it is the sum of


def nearest_kept(
    target: Array, A: Array, b: Array, rounding: Array, limits: tuple[Array, Array], order: Sequence[int]
) -> Array | None:
    """The input of this module's three rules, (n_u,); None where the iterations of `project` did not suffice.

    Args:
        target: the wanted input, (n_u,).
        A: rows of length 1, (r, n_u).
        b: (r,).
        rounding: rows that are missed by no more than this count as kept, (r,) [unit of b].
        limits: further rows and their bounds, which hold for some input.
        order: the indices of the rows, the most important one first.
    """
    rows, bounds = np.vstack([A, limits[0]]), np.concatenate([b, limits[1]])
    always = list(range(len(b), len(bounds)))
    ahead, lost = list(order), []
    while (found := _solve(target, rows, bounds, [*ahead, *always])).point is None:
        # The first row that the ones before it exclude: the last one of some proof, those before it being possible.
        while found.proof is not None:
            last = max((place for place, i in enumerate(ahead) if found.proof[i] > 0), default=-1)
            if last < 0 or not any(found.proof[i] > 0 for i in ahead[:last]):
                break
            before = _solve(target, rows, bounds, [*ahead[:last], *always])
            if before.point is not None:
                break
            found = before
        if found.proof is None or last < 0:
            return None
        i = ahead[last]
        highest = _highest(i, bounds, found.proof)
        if b[i] - highest <= rounding[i]:
            bounds[i] = highest
        else:
            lost.append(ahead.pop(last))
    for i in sorted(lost, key=list(order).index):
        ahead.append(i)
        while (found := _solve(target, rows, bounds, [*ahead, *always])).point is None:
            if found.proof is None or found.proof[i] == 0:
                return None
            bounds[i] = _highest(i, bounds, found.proof)
    return found.point


def _solve(target: Array, rows: Array, bounds: Array, used: list[int]) -> Projection:
    """`project` onto some of the rows, its proof in terms of all of them."""
    found = project(target, rows[used], bounds[used])
    if found.proof is None:
        return found
    proof = np.zeros(len(bounds))
    proof[used] = found.proof
    return Projection(None, proof)


def _highest(i: int, bounds: Array, proof: Array) -> float:
    """A lower bound for row i, the highest that the proof y allows: a_i·u ≤ −Σ_{j≠i} y_j b_j / y_i.

    It falls with each proof to another one of finitely many values.
    """
    terms = proof * bounds
    terms[i] = 0.0
    highest = -(float(terms.sum()) + _MARGIN * float(np.abs(terms).sum())) / float(proof[i])
    return min(highest, float(np.nextafter(bounds[i], -np.inf)))
