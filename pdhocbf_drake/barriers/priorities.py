"""The input nearest to a wanted one under rows that need not all be possible: those that can be kept are kept exactly.

Rows a_i·u ≥ b_i in an order of priority, within limits that always hold:

1. A row is kept if some input satisfies it together with the limits and all rows of higher priority that are kept.
2. Each other row, in the same order, is missed by as little as the limits, the kept rows and the rows before allow.
3. Of the inputs that are left, the one nearest to the wanted one is taken.

So a row that is out of reach costs no row that is within reach, whatever their order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.barriers.projection import Array, Projection, project

_ATTEMPTS = 30  # to lower a bound
_MARGIN_OF_NOISE = 1e-6
_MARGIN = 1e-13  # by which a bound stays below its supremum, as a share of the terms that it is the sum of


class Kept(NamedTuple):
    """The answer of `nearest_kept`.

    Attributes:
        input: u, (n_u,).
        lost: the indices of the rows that are missed.
    """

    input: Array
    lost: list[int]


def nearest_kept(
    target: Array,
    A: Array,
    b: Array,
    limits: tuple[Array, Array],
    order: Sequence[int],
    rounding: Callable[[], Array],
) -> Kept | None:
    """The input of this module's three rules; None where the iterations of `project` did not suffice.

    Args:
        target: the wanted input, (n_u,).
        A: rows of length 1, (r, n_u).
        b: (r,).
        limits: further rows and their bounds, which hold for some input.
        order: the indices of the rows, the most important one first.
        rounding: rows that are missed by no more than this count as kept, (r,) [unit of b]; asked for if needed.
    """
    rows, bounds = np.vstack([A, limits[0]]), np.concatenate([b, limits[1]])
    always, ahead = list(range(len(b), len(bounds))), list(order)
    found = _solve(target, rows, bounds, [*ahead, *always])
    if found.point is not None:
        return Kept(found.point, [])
    noise = rounding()
    lost: dict[int, Array] = {}
    for attempt in range(_ATTEMPTS * (len(b) + 1)):
        # The first row that the ones before it exclude: the last one of some proof, those before it being possible.
        before = None
        while (last := _last(ahead, found)) > 0 and _last(ahead[:last], found) >= 0:
            before = _solve(target, rows, bounds, [*ahead[:last], *always])
            if before.point is not None:
                break
            found, before = before, None
        if last < 0 or found.proof is None:
            return None
        i = ahead[last]
        highest = _highest(i, bounds, found.proof, noise[i], attempt)
        if b[i] - highest <= noise[i]:
            bounds[i], before = highest, None
        else:
            lost[ahead.pop(last)] = found.proof
        found = before if before and last == len(ahead) else _solve(target, rows, bounds, [*ahead, *always])
        if found.point is not None:
            break
    for i in (i for i in order if i in lost):
        if all(j in ahead or j == i for j in np.flatnonzero(lost[i][: len(b)])):
            bounds[i] = _highest(i, bounds, lost[i], noise[i], 0)
        ahead.append(i)
        for attempt in range(_ATTEMPTS):
            found = _solve(target, rows, bounds, [*ahead, *always])
            if found.point is not None or found.proof is None or found.proof[i] == 0:
                break
            bounds[i] = _highest(i, bounds, found.proof, noise[i], attempt)
        if found.point is None:
            ahead.pop()
    found = _solve(target, rows, bounds, [*ahead, *always]) if found.point is None else found
    return None if found.point is None else Kept(found.point, list(lost))


def _last(ahead: list[int], found: Projection) -> int:
    """The place of the last row of a proof among the ones ahead, −1 for none."""
    proof = found.proof
    return -1 if proof is None else max((place for place, i in enumerate(ahead) if proof[i] > 0), default=-1)


def _solve(target: Array, rows: Array, bounds: Array, used: list[int]) -> Projection:
    """`project` onto some of the rows, its proof in terms of all of them."""
    found = project(target, rows[used], bounds[used])
    if found.proof is None:
        return found
    proof = np.zeros(len(bounds))
    proof[used] = found.proof
    return Projection(None, proof)


def _highest(i: int, bounds: Array, proof: Array, noise: float, attempt: int) -> float:
    """A lower bound for row i, the highest that the proof y allows: a_i·u ≤ −Σ_{j≠i} y_j b_j / y_i.

    It falls with each proof to another one of finitely many values; after the first attempt, by a share of its
    rounding more each time.
    """
    terms = proof * bounds
    terms[i] = 0.0
    margin = _MARGIN * float(np.abs(terms).sum()) / float(proof[i]) + (_MARGIN_OF_NOISE * noise if attempt else 0.0)
    highest = -float(terms.sum()) / float(proof[i]) - 2.0**attempt * margin
    return min(highest, float(np.nextafter(bounds[i], -np.inf)))
