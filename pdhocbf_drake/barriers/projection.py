"""The point of a polyhedron that is nearest to a given one, or the proof that the polyhedron is empty."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_EPS = 32 * float(np.finfo(float).eps)  # rounding of b_i − a_i·x, as a share of its terms
_STARTS = 3
_CYCLING = 1e-12  # rows missed by more, as a share of their terms, are not missed by rounding
_DEPENDENT = 1e-12  # a unit row that differs by less from a combination of others is that combination


class Projection(NamedTuple):
    """The answer of `project`.

    Attributes:
        point: x, (n,); None where the polyhedron is empty, or the iterations did not suffice.
        proof: y ≥ 0 with Σ y_i a_i = 0 and Σ y_i b_i > 0, (r,), so that no x satisfies all rows (Farkas); its support
            is an irreducible set of such rows. None where there is a point, or no proof.
    """

    point: Array | None
    proof: Array | None = None


def project(target: Array, A: Array, b: Array) -> Projection:
    """min_x ‖x − target‖² subject to A x ≥ b, by the dual active-set method of Goldfarb and Idnani (1983).

    Every comparison is relative to the numbers compared, so that a common factor on b and target is one on x. The
    active rows are held as W = R Qᵀ with orthonormal columns Q, so that rows at an angle of 1e-6 are told apart to ten
    digits.

    Args:
        target: (n,).
        A: rows of length 1, (r, n).
        b: (r,).
    """
    start = target
    for _ in range(_STARTS):
        found, settled = _dual(start, A, b)
        if settled or found.point is None:
            break
        start = found.point  # rounding is that of the target: nearer to the answer there is less of it
    return found


def _dual(target: Array, A: Array, b: Array) -> tuple[Projection, bool]:
    """The answer of `project`, and False where rows are left that it misses, by rounding alone."""
    x, rounding, rounding_of_b = target, _EPS * np.abs(A), _EPS * np.abs(b)
    active, prices, basis = list[int](), np.zeros(0), _Basis.of(A[:0])
    doubtful = list[int]()
    for _ in range(6 * (len(b) + 2)):
        short = b - A @ x - rounding @ np.abs(x) - rounding_of_b
        short[active + doubtful] = 0.0
        entering = int(short.argmax()) if len(short) else -1
        if entering < 0 or short[entering] <= 0:
            return Projection(x), not doubtful
        row, price = A[entering], 0.0
        while True:
            along, across, length = basis.split(row)
            weights = along @ basis.inverse
            full = float(b[entering] - row @ x) / length**2 if length > _DEPENDENT else np.inf
            least = _DEPENDENT * max(1.0, max(map(abs, weights), default=0.0))
            ratios = [price_j / w if w > least else np.inf for price_j, w in zip(prices, weights, strict=True)]
            partial = min(ratios, default=np.inf)
            step = min(full, partial)
            if step == np.inf:
                break
            price += step
            prices = np.maximum(prices - step * weights, 0.0)
            if full <= partial:
                break
            x = x + step * across if full < np.inf else x
            leaving = ratios.index(partial)  # this row would pull x towards itself
            del active[leaving]
            prices, basis = np.delete(prices, leaving), _Basis.of(A[active])
        if step < np.inf:
            active.append(entering)
            prices, basis = np.append(prices, price), basis.extended(along, across, length)
            x = (target - basis.Q @ (target @ basis.Q)) + basis.Q @ (basis.inverse @ b[active])
            continue
        proof = np.zeros(len(b))
        proof[active], proof[entering] = np.where(weights < -least, -weights, 0.0), 1.0
        if proof @ b > proof @ rounding_of_b:
            return Projection(None, proof), True
        doubtful.append(entering)
    small = np.all(b - A @ x <= _CYCLING * (np.abs(b) + np.abs(x).max() + np.abs(target).max()))
    return Projection(x if small else None), False


class _Basis(NamedTuple):
    """Independent rows W = R Qᵀ, (k, n): orthonormal columns Q, (n, k), and R⁻¹, lower triangular, (k, k)."""

    Q: Array
    inverse: Array

    @classmethod
    def of(cls, rows: Array) -> _Basis:
        basis = cls(np.zeros((rows.shape[1], 0)), np.zeros((0, 0)))
        for row in rows:
            basis = basis.extended(*basis.split(row))
        return basis

    def split(self, row: Array) -> tuple[Array, Array, float]:
        """A row's coordinates along Q, its part across Q, and the length of that."""
        if not self.Q.shape[1]:
            return np.zeros(0), row, 1.0
        along = row @ self.Q
        across = row - self.Q @ along
        again = across @ self.Q  # twice, since the part across may be small
        across = across - self.Q @ again
        return along + again, across, math.sqrt(float(across @ across))

    def extended(self, along: Array, across: Array, length: float) -> _Basis:
        """The basis with one more row, from its parts."""
        k = len(along)
        Q, inverse = np.empty((len(across), k + 1)), np.zeros((k + 1, k + 1))
        Q[:, :k], Q[:, k] = self.Q, across / length
        inverse[:k, :k], inverse[k, :k], inverse[k, k] = self.inverse, -(along @ self.inverse) / length, 1.0 / length
        return _Basis(Q, inverse)
