"""Polytopes without an interior, such as a box with a fixed state: each is a polytope within its affine hull.

An equation among the limits of x(k+1) is one on x(k) and u(k) together. So the predecessor of a flat set is the
projection of a polytope in (x, u), while that of any other is a Minkowski sum (`invariant_set.predecessor_rows`).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import linprog

from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.polytope import ROUNDED, THINNEST, Array, Polytope, bounding_box

Rows = tuple[Array, Array]

_EQUATION = 5.0 * THINNEST  # rows that leave less room than this are equations
_MISSED = 1e-9  # rows that contradict each other by less do not
_SOLVER = {"primal_feasibility_tolerance": 0.1 * _MISSED, "dual_feasibility_tolerance": 0.1 * _MISSED}


def flat_polytope(A: Array, b: Array) -> Polytope | None:
    """{x : A x ≤ b}, flat or not; None where it is empty. Raises `InputError` where it is unbounded."""
    box = bounding_box(A, b)
    if box is None:
        return None
    centre = 0.5 * (box[0] + box[1])
    unit = positive(0.5 * (box[1] - box[0]), centre)
    corners = _corners(A, b, centre, unit)
    return None if corners is None else _spanned(corners, unit)


def flat_predecessor(
    system: PeriodicAffineSystem, k: int, here: Polytope, inputs: Polytope, target: Rows, unit: Array
) -> Polytope | None:
    """{x ∈ here : A_k x + B_k u + c_k ∈ target for some u ∈ inputs}, flat or not; None where it is empty.

    Args:
        system: x(k+1) = A_k x + B_k u + c_k.
        here, inputs: limits of x(k) and of u(k), flat or not.
        target: the rows A, b of the set of x(k+1).
        unit: of each state, (n,).
    """
    rows, bounds = step_rows(system, k, here, inputs, target, unit)
    centre = np.concatenate([here.centre, inputs.centre])
    corners = _corners(rows, bounds, centre, np.concatenate([unit, positive(inputs.unit, inputs.centre)]))
    return None if corners is None else _spanned(corners[:, : system.n], unit)


def step_rows(
    system: PeriodicAffineSystem, k: int, here: Polytope, inputs: Polytope, target: Rows, unit: Array
) -> Rows:
    """Rows on (x, u), shape (r, n + m), for x ∈ here, u ∈ inputs, and A_k x + B_k u + c_k ∈ target."""
    rows, bounds = target
    size = np.linalg.norm(rows * unit, axis=1)[:, None]
    after = np.hstack([rows @ system.A(k), rows @ system.B(k)]) / size
    left = (bounds - rows @ system.c(k)) / size[:, 0]
    now = [np.hstack([here.A, np.zeros((len(here.A), system.m))]),
           np.hstack([np.zeros((len(inputs.A), system.n)), inputs.A])]  # fmt: skip
    return np.vstack([*now, after]), np.concatenate([here.b, inputs.b, left])


def positive(unit: Array, values: Array) -> Array:
    """Units without a zero: for a coordinate that is fixed, the magnitude of its value, or 1."""
    size = np.abs(values)
    return np.where(unit > THINNEST**2 * size, unit, np.where(size > 0.0, size, 1.0))


def _corners(A: Array, b: Array, centre: Array, unit: Array) -> Array | None:
    """The vertices of {z : A z ≤ b}, flat or not; None where it is empty.

    Rows that can only be met with equality are found by one linear program (Freund, Roundy and Todd, 1985),

        max Σ s_i   subject to   A z + s ≤ λ b,   0 ≤ s ≤ 1,   λ ≥ 1,

    in which s_i = 0 for them; an upper limit of λ makes equations of the rows that leave less room than `_EQUATION`.
    """
    b, A = b - A @ centre, A * unit
    size = np.linalg.norm(A, axis=1)
    zero = size <= THINNEST**2  # 0 ≤ b
    if np.any(b[zero] < -_MISSED):
        return None
    A, b = A[~zero] / size[~zero, None], b[~zero] / size[~zero]
    count, n = A.shape
    found = linprog(
        -np.concatenate([np.zeros(n), np.ones(count), [0.0]]),
        A_ub=np.hstack([A, np.eye(count), -b[:, None]]),
        b_ub=np.zeros(count),
        bounds=[(None, None)] * n + [(0.0, 1.0)] * count + [(1.0, 1.0 / _EQUATION)],
        method="highs",
        options=_SOLVER,
    )
    if not found.success:
        return None
    point, equal = found.x[:n] / found.x[-1], found.x[n:-1] < 0.5
    along = null_space(A[equal], rcond=THINNEST) if equal.any() else np.eye(n)
    if equal.any():
        point = point - np.linalg.pinv(A[equal], rcond=THINNEST) @ (A[equal] @ point - b[equal])
    corners = point[None]
    if along.shape[1]:
        part = Polytope.from_rows(A[~equal] @ along, b[~equal] - A[~equal] @ point)
        if part is None:
            raise InputError(ROUNDED)
        corners = point + part.vertices @ along.T
    return np.asarray(centre + unit * corners)


def _spanned(points: Array, unit: Array) -> Polytope:
    """The hull of points, flat or not; each equation is two of its rows."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    offsets = (points - centre) / unit
    axes = np.linalg.svd(offsets, full_matrices=True)[2]
    wide = np.ptp(offsets @ axes.T, axis=0) > THINNEST
    along, across = axes[wide], axes[~wide]
    normals, bounds, corners = np.vstack([across, -across]), np.zeros(2 * len(across)), points[:1]
    if wide.any():
        part = Polytope.from_vertices(offsets @ along.T)
        if part is None:
            raise InputError(ROUNDED)
        normals, bounds = np.vstack([normals, part.A @ along]), np.concatenate([bounds, part.b])
        still = np.ptp(offsets, axis=0) <= THINNEST
        corners = np.where(still, centre, centre + unit * (part.vertices @ along))
    rows = np.where(np.abs(normals) > THINNEST**2, normals, 0.0) / unit
    size = np.linalg.norm(rows, axis=1)
    rows /= size[:, None]
    return Polytope(rows, bounds / size + rows @ centre, corners)
