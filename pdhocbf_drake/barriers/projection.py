"""The point of a polyhedron that is nearest to a given one, or the proof that the polyhedron is empty."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_EPS = 32 * float(np.finfo(float).eps)  # rounding of b_i − a_i·x, as a share of its terms
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
    active rows are held in a QR factorization, so that rows at an angle of 1e-6 are told apart to ten digits.

    Args:
        target: (n,).
        A: rows of length 1, (r, n).
        b: (r,).
    """
    x, active, multipliers = target, list[int](), np.zeros(0)
    Q, R = np.zeros((len(target), 0)), np.zeros((0, 0))
    entering = -1
    for _ in range(10 * (len(b) + 2)):
        if entering < 0:
            short = b - A @ x - _EPS * (np.abs(b) + np.abs(A) @ np.abs(x))
            short[active] = 0.0
            entering = int(np.argmax(short)) if len(short) else -1
            if entering < 0 or short[entering] <= 0:
                return Projection(x)
            price = 0.0
        row = A[entering]
        part = Q.T @ row
        across = row - Q @ part
        again = Q.T @ across  # twice, since across may be small
        across, part = across - Q @ again, part + again
        weights = np.linalg.solve(R, part) if active else part
        length = float(across @ across)
        full = (b[entering] - row @ x) / length if length > _DEPENDENT**2 else np.inf
        falling = weights > _DEPENDENT * max(1.0, np.abs(weights).max(initial=0.0))
        ratios = np.full(len(active), np.inf)
        ratios[falling] = multipliers[falling] / weights[falling]
        leaving = int(np.argmin(ratios)) if active else -1
        partial = ratios[leaving] if active else np.inf
        step = min(full, partial)
        if step == np.inf:
            proof = np.zeros(len(b))
            proof[active], proof[entering] = np.maximum(-weights, 0.0), 1.0
            return Projection(None, proof)
        price += step
        multipliers = np.maximum(multipliers - step * weights, 0.0)
        if partial < full:  # the row that leaves would pull x in its direction
            x = x + step * across if np.isfinite(full) else x
            del active[leaving]
            multipliers = np.delete(multipliers, leaving)
            Q, R = np.linalg.qr(A[active].T)
            continue
        active.append(entering)
        Q, R = np.linalg.qr(A[active].T)
        x = (target - Q @ (Q.T @ target)) + Q @ np.linalg.solve(R.T, b[active])
        multipliers, entering = np.append(multipliers, price), -1
    return Projection(None)
