"""A safety filter for any differentiable h and dynamics: an obstacle in the plane, a clipped or squared input."""

from __future__ import annotations

import importlib
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pdhocbf_drake.barriers.filter import Array, BarrierFilter, FilterResult, Linearisation, rounding_of
from pdhocbf_drake.barriers.relative_degree import enforced_values, psi_sizes

_STEPS = 12  # linearisations from one starting point
_SHARES = 0.5 ** np.arange(9)  # of a step, until it is an improvement
_LITTLE = 0.98  # of a shortfall left after a step is too much for another one
_STARTS = 4  # further starting points, the best ones of those that are tried
_ROUNDING = 1e-15  # a step of this share of the distance to the wanted input is none
_SETTLED = 1e-9  # shortfalls that differ by a smaller share are one
_NOT_FOUND = "no input was found that satisfies every barrier at once"


class _Point(NamedTuple):
    """An input with ψ_m there and its shortfalls, and its rank: the smaller, the better."""

    input: Array
    psi: Array
    slack: Array
    rank: tuple[float, ...]


class NonlinearFilter(BarrierFilter):
    """min_u ‖u − u_wanted‖² subject to ψ_m(k) ≥ tightening for each barrier, and lower ≤ u ≤ upper, ψ_m nonlinear in u.

    A sequence of convex programs: ψ_m is linearised at an input, the input nearest to the wanted one is found as in
    `BarrierFilter`, with the same priorities, and a step towards it is shortened until ψ_m itself confirms that it is
    an improvement. It starts at the wanted input within its limits. Where that ends at an input that misses a barrier,
    it starts again from others; where it ends at a safe one, SLSQP of SciPy makes it the nearest one around. Then:

    - "solved": ψ_m ≥ tightening for all barriers at the answer, within rounding. No input near it is nearer to the
      wanted one; one far from it may be.
    - "softened": no input with ψ_m ≥ tightening for all was found, which is no proof that there is none. The barriers
      of higher priority are kept, or missed by less.
    - "failed": a number that is not finite, or an exception in h or the dynamics; the input is the wanted one, clipped.

    A call costs a few milliseconds where the wanted input is not safe. `BarrierFilter` is faster and finds the nearest
    of all inputs, or proves that there is none, where ψ_m is affine in the input.

    Args:
        system, barriers, lower, upper, tightening, priority, states, disturbance, estimate, delay: as in
            `BarrierFilter`.

    Raises:
        InputError: as `BarrierFilter`, but for a ψ_m that is not affine.
    """

    def _check_inputs(self, states: ArrayLike | None) -> None:
        """Any ψ_m will do. Loads what the first call would otherwise wait for."""
        importlib.import_module("scipy.optimize")

    def _search(self, k: int, state: Array, target: Array, rows: Linearisation) -> FilterResult:
        size = psi_sizes(self.barriers, self.system, k, state, rows.point)
        best = self._descend(k, state, target, rows, size)
        if np.any(best.slack):
            tried = [self._point(k, state, target, rows, start, size) for start in self._others(k, state, rows)]
            for start in sorted(tried, key=_rank)[:_STARTS]:
                best = min(best, self._descend(k, state, target, self._rows(k, state, start.input), size), key=_rank)
                if not np.any(best.slack):
                    break
        best = self._polished(k, state, target, self._point(k, state, target, rows, best.input))
        if np.any(best.slack):
            return FilterResult(best.input, "softened", best.psi, best.slack, _NOT_FOUND)
        return FilterResult(best.input, "solved", best.psi, best.slack)

    def _point(
        self, k: int, state: Array, target: Array, rows: Linearisation, u: Array, size: Array | None = None
    ) -> _Point:
        """ψ_m at u and its shortfalls beyond the rounding of its terms, whose size is that at u unless given."""
        psi = enforced_values(self.barriers, self.system, k, state, u)
        slack = np.maximum(self.tightening - np.nan_to_num(psi, nan=-np.inf), 0.0)
        if np.any(slack):
            size = psi_sizes(self.barriers, self.system, k, state, u) if size is None else size
            slack = np.where(slack <= rounding_of(size, rows), 0.0, slack)
        ordered = slack[self._order]
        return _Point(u, psi, slack, (*(ordered > 0.0), *ordered, float(np.linalg.norm(u - target))))

    def _descend(self, k: int, state: Array, target: Array, rows: Linearisation, size: Array) -> _Point:
        """The first input on the way from that of `rows` that misses no barrier, or the best one."""
        here = self._point(k, state, target, rows, rows.point, size)
        for _ in range(_STEPS):
            if not (np.all(np.isfinite(rows.psi)) and np.all(np.isfinite(rows.gradient))):
                break
            aim, _ = self._nearest(k, state, target, rows)
            if aim is None or not np.linalg.norm(aim - here.input) > _ROUNDING * np.linalg.norm(aim - target):
                break
            way = aim - here.input
            steps = (self._point(k, state, target, rows, here.input + share * way, size) for share in _SHARES)
            after = next((point for point in steps if point.rank < here.rank), None)
            if after is None:
                break
            little = np.all(after.slack >= _LITTLE * here.slack)
            here = after
            if little or not np.any(here.slack):
                break
            rows = self._rows(k, state, here.input)
        return here

    def _others(self, k: int, state: Array, rows: Linearisation) -> list[Array]:
        """Further starting points: as far from that of `rows` as it takes to change a missed ψ_m, and corners."""
        count = self.system.m
        directions = [np.array(signs, dtype=float) for signs in product((-1, 0, 1), repeat=min(count, 3)) if any(signs)]
        directions = [np.resize(signs, count) for signs in directions]
        missed = self.tightening - rows.psi
        reach = 1.0
        with np.errstate(all="ignore"):
            for reach in 10.0 ** np.arange(-12, 13):
                psi = enforced_values(self.barriers, self.system, k, state, rows.point + reach * directions[-1])
                if np.any((np.abs(psi - rows.psi) > 0.5 * missed) & (missed > 0)):
                    break
        around = [rows.point + share * reach * way for share in (1.0, 3.0) for way in directions]
        bounded = np.isfinite(self.lower) & np.isfinite(self.upper)
        low, high = np.where(bounded, self.lower, rows.point), np.where(bounded, self.upper, rows.point)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        inside = [middle + share * half * way for share in (0.5, 1.0) for way in directions]
        return [np.clip(point, self.lower, self.upper) for point in (*around, middle, *inside)]

    def _polished(self, k: int, state: Array, target: Array, best: _Point) -> _Point:
        """The missed ψ_m raised one after the other, as far as kept ones and those before allow; then the nearest."""
        missed = [i for i in self._order if best.slack[i] > 0.0]
        for place, i in enumerate(missed):
            levels = np.where(best.slack > 0.0, best.psi, self.tightening)
            levels[missed[place:]] = -np.inf
            best = min(best, self._program(k, state, target, best, levels, i), key=_rank)
        levels = np.where(best.slack > 0.0, best.psi, self.tightening)
        nearest = self._program(k, state, target, best, levels, None)
        return nearest if nearest.rank[-1] < best.rank[-1] and self._no_worse(nearest, best) else best

    def _no_worse(self, point: _Point, than: _Point) -> bool:
        return bool(np.all(point.slack <= than.slack * (1.0 + _SETTLED)))

    def _program(self, k: int, state: Array, target: Array, start: _Point, levels: Array, raised: int | None) -> _Point:
        """The input around `start` nearest to the wanted one, or with the largest ψ_m of one barrier, by SLSQP.

        Constraints are ψ_m ≥ levels and the limits. Inputs are in units of the distance to the wanted one and each
        ψ_m in units of its slope, so that the program does not depend on the user's units.
        """
        from scipy.optimize import minimize  # takes a fifth of a second to load, which is for users of this filter

        rows = self._rows(k, state, start.input)
        slope = np.linalg.norm(rows.gradient, axis=1)
        scale = float(np.linalg.norm(start.input - target))
        if raised is not None and slope[raised] > 0.0:
            scale = max(scale, float(start.slack[raised] / slope[raised]))
        with np.errstate(invalid="ignore"):
            length = np.maximum(scale * slope, np.where(np.isfinite(levels), np.abs(start.psi - levels), 0.0))
        used = np.flatnonzero((length > 0.0) & np.isfinite(levels))
        if not (scale > 0.0 and np.all(np.isfinite(slope)) and (raised is None or slope[raised] > 0.0)):
            return start

        def values(v: Array) -> Array:
            return enforced_values(self.barriers, self.system, k, state, start.input + scale * v)

        def slopes(v: Array) -> Array:
            return self._rows(k, state, start.input + scale * v).gradient * scale

        wanted = (target - start.input) / scale

        def objective(v: Array) -> tuple[float, Array]:
            if raised is None:
                return 0.5 * float((v - wanted) @ (v - wanted)), v - wanted
            return (start.psi[raised] - values(v)[raised]) / length[raised], -slopes(v)[raised] / length[raised]

        with np.errstate(all="ignore"):
            found = minimize(
                objective, np.zeros(self.system.m), jac=True, method="SLSQP",
                bounds=list(zip((self.lower - start.input) / scale, (self.upper - start.input) / scale, strict=True)),
                constraints={
                    "type": "ineq",
                    "fun": lambda v: (values(v)[used] - levels[used]) / length[used],
                    "jac": lambda v: slopes(v)[used] / length[used, None],
                },
                options={"ftol": 1e-14, "maxiter": 50},
            )  # fmt: skip
        if not np.all(np.isfinite(found.x)):
            return start
        u: Array | None = np.clip(start.input + scale * found.x, self.lower, self.upper)
        for _ in range(2):  # back onto the levels, which SLSQP misses by its tolerance
            rows = self._rows(k, state, u) if u is not None else rows
            u, _ = self._nearest(k, state, rows.point, rows, levels)
        return self._point(k, state, target, rows, rows.point if u is None else u)


def _rank(point: _Point) -> tuple[float, ...]:
    return point.rank
