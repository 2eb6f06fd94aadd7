"""Bounded convex polytopes, each with its vertices and its facets; Qhull computes the one from the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from pdhocbf_drake.barriers.linear_program import minimum
from pdhocbf_drake.errors import InputError

Array = NDArray[np.float64]
T = TypeVar("T")

THINNEST = 1e-7
"""A polytope without an inscribed ball of this radius is empty, in its unit of each coordinate."""
_FLAT = 1e-12  # a side that is shorter than this share of its coordinates is none
_SAME = 1e-10  # unit rows and vertices that differ by less are one
ROUNDED = "a polytope was lost to rounding: scale the states to similar sizes"
_UNBOUNDED = "a polytope must be bounded: limit every state, if only loosely"
_WIDE = ("QH6271", "QH6297")  # Qhull's errors for nearly coincident vertices
_DEEP = 1e-3  # margin from which on an inner point is good enough, in the same unit


@dataclass(frozen=True)
class Polytope:
    """P = {x : A x ≤ b} = hull of its vertices, bounded; flat where limits fix a coordinate, else with an interior.

    Attributes:
        A: outward unit normals of the facets, shape (r, n); each equation of a flat one is two of them.
        b: their offsets, shape (r,) [unit of x].
        vertices: shape (v, n) [unit of x].
    """

    A: Array
    b: Array
    vertices: Array

    @classmethod
    def from_vertices(cls, points: ArrayLike) -> Polytope | None:
        """The convex hull of points, shape (v, n); None where it has no interior."""
        given = np.asarray(points, dtype=float)
        low, high = given.min(axis=0), given.max(axis=0)
        if _is_flat(low, high):
            return None
        if given.shape[1] == 1:
            return cls(np.array([[1.0], [-1.0]]), np.concatenate([high, -low]), np.array([low, high]))
        centre, unit = 0.5 * (low + high), 0.5 * (high - low)
        try:
            hull = _hull((given - centre) / unit)
        except (QhullError, ValueError):  # flat, or too few points
            return None
        # Qhull cuts every facet into simplices, each with the facet's own plane.
        facets = _unique(hull.equations)
        rows = facets[:, :-1] / unit
        size = np.linalg.norm(rows, axis=1)
        rows /= size[:, None]
        return cls(rows, rows @ centre - facets[:, -1] / size, given[hull.vertices])

    @classmethod
    def from_rows(
        cls, A: ArrayLike, b: ArrayLike, near: ArrayLike | None = None, unit: ArrayLike | None = None
    ) -> Polytope | None:
        """{x : A x ≤ b} without its redundant rows; None where it has no interior.

        Args:
            near: a guess of an inner point.
            unit: of each coordinate, in which `THINNEST` is meant, (n,); by default half the sides of the smallest box
                around the polytope, so that no factor on any coordinate makes a difference.

        Raises:
            InputError: the rows leave x unbounded.
        """
        rows, bounds = np.asarray(A, dtype=float), np.asarray(b, dtype=float)
        if unit is None:
            box = bounding_box(rows, bounds)
            if box is None or _is_flat(*box):
                return None
            centre, scale = 0.5 * (box[0] + box[1]), 0.5 * (box[1] - box[0])
        else:
            scale = np.asarray(unit, dtype=float)
            centre = np.zeros(len(scale)) if near is None else np.asarray(near, dtype=float)
        rows, bounds = rows * scale, bounds - rows @ centre
        size = np.linalg.norm(rows, axis=1)
        zero = size <= _SAME * np.abs(bounds)  # 0 ≤ b, as far as x can reach
        if np.any(bounds[zero] < 0):
            return None
        rows, bounds = rows[~zero] / size[~zero, None], bounds[~zero] / size[~zero]
        inner = None if near is None else (np.asarray(near, dtype=float) - centre) / scale
        if inner is None or (bounds - rows @ inner).min() < _DEEP:
            inner = inner_point(rows, bounds)
        if inner is None:
            return None
        corners = _corners(rows, bounds, inner)
        if corners is None and near is not None:
            inner = inner_point(rows, bounds)  # the deepest one is the best conditioned
            corners = None if inner is None else _corners(rows, bounds, inner)
        if corners is None:
            raise InputError(ROUNDED)
        if not np.isfinite(corners).all():
            raise InputError(_UNBOUNDED)
        return _body(cls.from_vertices(centre + scale * _unique(corners)))

    @classmethod
    def box(cls, lower: ArrayLike, upper: ArrayLike) -> Polytope:
        """{x : lower ≤ x ≤ upper}, flat where an entry has lower = upper.

        Raises:
            InputError: limits that are not finite, or leave nothing.
        """
        low, high = np.atleast_1d(np.asarray(lower, dtype=float)), np.atleast_1d(np.asarray(upper, dtype=float))
        if low.shape != high.shape or not np.all(np.isfinite([low, high])) or np.any(low > high):
            raise InputError(f"a box needs finite limits with lower ≤ upper, given {low.tolist()} and {high.tolist()}")
        eye = np.eye(len(low))
        rows, bounds = np.vstack([eye, -eye]), np.concatenate([high, -low])
        if np.any(low == high):
            return cls(rows, bounds, np.unique(list(product(*zip(low, high, strict=True))), axis=0))
        return _body(cls.from_rows(rows, bounds, 0.5 * (low + high), 0.5 * (high - low)))

    @property
    def dimension(self) -> int:
        """n."""
        return int(self.vertices.shape[1])

    @property
    def centre(self) -> Array:
        """The mean of the vertices, a point well inside."""
        return np.asarray(self.vertices.mean(axis=0))

    @property
    def unit(self) -> Array:
        """Half the extent along each coordinate, (n,) [unit of x]."""
        return np.asarray(0.5 * np.ptp(self.vertices, axis=0))

    def violation(self, points: ArrayLike) -> Array:
        """max_i (A_i x − b_i) at each point, shape (p, n) → (p,); ≤ 0 inside [unit of x]."""
        return np.asarray((np.asarray(points) @ self.A.T - self.b).max(axis=-1))

    @property
    def free(self) -> tuple[int, ...]:
        """The first coordinates that determine the others, as many as P has dimensions; all where P has an interior."""
        offsets = self.vertices - self.centre
        offsets = offsets / np.where(self.unit > 0.0, self.unit, 1.0)
        free: list[int] = []
        for i in range(self.dimension):
            among = offsets[:, [*free, i]]
            if self.unit[i] > 0.0 and np.linalg.matrix_rank(among, tol=THINNEST) > len(free):
                free.append(i)
        return tuple(free)

    @property
    def rank(self) -> int:
        """The number of dimensions that P has, n unless it is flat."""
        return len(self.free)

    def volume(self) -> float:
        """Length, area, volume, … of the free coordinates [their unit]; 0 for a point."""
        free = list(self.free)
        corners, unit = self.vertices[:, free], self.unit[free]
        if len(free) < 2:
            return float(np.ptp(corners)) if free else 0.0
        return float(ConvexHull((corners - corners.mean(axis=0)) / unit).volume * np.prod(unit))

    @property
    def outline(self) -> Array:
        """The vertices of a polygon, in order around it, shape (v, 2)."""
        around = (self.vertices - self.centre) / np.ptp(self.vertices, axis=0)
        return np.asarray(self.vertices[np.argsort(np.arctan2(around[:, 1], around[:, 0]))])

    def sample(self, random: np.random.Generator) -> Array:
        """A random point, uniform in P, shape (n,); P must have an interior."""
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        while True:
            point = random.uniform(low, high)
            if self.violation(point) <= 0.0:
                return np.asarray(point)

    def swept(self, directions: Sequence[Array] | Array) -> Polytope:
        """The Minkowski sum with the hull of some points, shape (d, n)."""
        return _body(Polytope.from_vertices(np.concatenate([self.vertices + each for each in np.asarray(directions)])))

    def less(self, points: Array, unit: Array | None = None) -> Polytope | None:
        """The Pontryagin difference {x : x + w ∈ P for all w of the hull of points}; None where it has no interior.

        Args:
            points: shape (w, n).
            unit: as in `from_rows`; by default half the extent of P.
        """
        return Polytope.from_rows(
            self.A, self.b - support(self.A, points), self.centre, self.unit if unit is None else unit
        )

    def slice(self, values: ArrayLike) -> Polytope | None:
        """{y : (y, values) ∈ P}, with the last coordinates fixed; None where it has no interior."""
        fixed = np.atleast_1d(np.asarray(values, dtype=float))
        free = self.dimension - len(fixed)
        bounds = self.b - self.A[:, free:] @ fixed
        return Polytope.from_rows(self.A[:, :free], bounds, self.centre[:free], self.unit[:free])

    def shadow(self, size: int) -> Polytope:
        """The projection onto the first `size` coordinates."""
        return _body(Polytope.from_vertices(self.vertices[:, :size]))


def support(rows: Array, points: Array) -> Array:
    """max_w A_i·w over the hull of points, shape (r,)."""
    return np.asarray((points @ rows.T).max(axis=0))


def bounding_box(A: Array, b: Array) -> tuple[Array, Array] | None:
    """The smallest box around {x : A x ≤ b}; None where it is empty. Raises `InputError` where it is unbounded."""
    rows, sides = np.column_stack([b, -A]), []
    for axis in np.vstack([np.eye(A.shape[1]), -np.eye(A.shape[1])]):
        least = minimum(np.append(0.0, axis), rows)
        if least is None:
            return None
        if least.value == -np.inf:
            raise InputError(_UNBOUNDED)
        sides.append(least.value)
    low, high = np.split(np.array(sides), 2)
    return low, -high


def _hull(points: Array) -> ConvexHull:
    return _with_wide_facets(ConvexHull, points)


def _with_wide_facets(make: Callable[..., T], *arguments: Array) -> T:
    """What Qhull makes of some arguments; where facets are too wide to be merged, with these allowed, else joggled."""
    try:
        return make(*arguments)
    except QhullError as error:
        if not any(code in str(error) for code in _WIDE):
            raise
    try:
        return make(*arguments, qhull_options="Qt Q12")
    except QhullError:
        return make(*arguments, qhull_options="QJ")


def _is_flat(low: Array, high: Array) -> bool:
    return bool(np.any(high - low <= _FLAT * (np.abs(low) + np.abs(high))))


def _body(polytope: Polytope | None) -> Polytope:
    """A polytope that has an interior by its construction."""
    if polytope is None:  # pragma: no cover
        raise InputError(ROUNDED)
    return polytope


def _corners(A: Array, b: Array, inner: Array) -> Array | None:
    """The vertices of {x : A x ≤ b}, infinite ones where it is unbounded; None where Qhull finds none."""
    if A.shape[1] == 1:
        sides, up = b / A[:, 0], A[:, 0] > 0
        return np.array([[np.max(sides[~up], initial=-np.inf)], [np.min(sides[up], initial=np.inf)]])
    try:
        with np.errstate(divide="ignore", invalid="ignore"):  # unbounded
            return np.asarray(_with_wide_facets(HalfspaceIntersection, np.column_stack([A, -b]), inner).intersections)
    except QhullError:
        # Qhull also fails with too few rows to bound it.
        return np.full((1, A.shape[1]), np.inf) if len(A) <= A.shape[1] else None


def inner_point(A: Array, b: Array) -> Array | None:
    """The centre of the largest ball in {x : A x ≤ b}, rows of length 1; None if it is smaller than `THINNEST`."""
    n = A.shape[1]
    rows = np.column_stack([A, np.ones(len(A))])
    bounds = [(None, None)] * n + [(None, 1e3)]
    result = linprog(-np.eye(n + 1)[-1], A_ub=rows, b_ub=b, bounds=bounds, method="highs")
    if not result.success or result.x[-1] < THINNEST:
        return None
    return np.asarray(result.x[:-1])


def _unique(rows: Array) -> Array:
    """Rows in a fixed order without those that differ by less than `_SAME`."""
    order = np.lexsort(np.round(rows / _SAME).T)
    ordered = rows[order]
    new = np.ones(len(ordered), dtype=bool)
    new[1:] = np.abs(np.diff(ordered, axis=0)).max(axis=1) > _SAME
    return np.asarray(ordered[new])
