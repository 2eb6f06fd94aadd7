"""Small filter problems solved by enumeration of all active sets, and their lexicographic relaxation."""

from __future__ import annotations

from itertools import combinations

import numpy as np

SLACK = 1e-9
"""By which a row may be missed, of problems whose numbers are of size 1."""


def nearest(target: np.ndarray, A: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    """min ‖x − target‖² subject to A x ≥ b: the nearest feasible one of the projections onto all active sets."""
    best, least = None, np.inf
    for count in range(len(target) + 1):
        for rows in map(list, combinations(range(len(b)), count)):
            x = target
            if rows:
                x = target + np.linalg.lstsq(A[rows], b[rows] - A[rows] @ target, rcond=None)[0]
            if np.all(A @ x >= b - SLACK) and np.linalg.norm(x - target) < least:
                best, least = x, float(np.linalg.norm(x - target))
    return best


def highest(row: np.ndarray, A: np.ndarray, b: np.ndarray) -> float:
    """max row·x subject to A x ≥ b: the best feasible corner, of a bounded polyhedron."""
    n = A.shape[1]
    corners = [
        np.linalg.solve(A[rows], b[rows])
        for rows in map(list, combinations(range(len(b)), n))
        if abs(np.linalg.det(A[rows])) > 1e-9
    ]
    return max(float(row @ x) for x in corners if np.all(A @ x >= b - SLACK))


def kept_by_priority(target, A, b, limits, order) -> tuple[np.ndarray, set[int]]:
    """The nearest input after keeping what can be kept, in order, then missing the rest by the least; and the rest."""
    rows, bounds, missed = limits[0], limits[1], []
    for i in order:
        more = np.vstack([rows, A[i]]), np.append(bounds, b[i])
        if nearest(target, *more) is None:
            missed.append(i)
        else:
            rows, bounds = more
    for i in missed:
        least = highest(A[i], rows, bounds)
        rows, bounds = np.vstack([rows, A[i]]), np.append(bounds, least - 0.1 * SLACK)
    return nearest(target, rows, bounds), set(missed)
