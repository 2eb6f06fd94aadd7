"""A safety filter: the input nearest to a wanted one for which every barrier's ψ_m ≥ 0."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers.affine_input import check_affine_in_input
from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.checks import finite_number, number_array, shown, vector, whole_ticks
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem, check_system
from pdhocbf_drake.barriers.priorities import nearest_kept
from pdhocbf_drake.barriers.relative_degree import enforced_row, enforced_values, psi_sizes
from pdhocbf_drake.barriers.requirements import check_barriers
from pdhocbf_drake.barriers.uncertainty import robust_barrier
from pdhocbf_drake.errors import InputError

Array = NDArray[np.float64]

_NOTHING = 1e-4  # share of the above that ψ_m may fall short by
_ROUNDING = 1e-12  # of ψ_m, as a share of its `psi_sizes`
_ROUNDING_OF_INPUT = 2e-15  # of an answer, as a share of the wanted input
_SETTLED = 1e-9  # a linear ψ_m that errs by less than the effect of this share of the input is exact
_LINEARISATIONS = 5  # of ψ_m from one starting point, where it is not affine in the input
_EXCLUDED = "no input satisfies every barrier at once"
_WITHIN = "no input within its limits satisfies every barrier at once"
_NOT_AFFINE = "psi is not affine in the input here, and no input was found that satisfies every barrier"


class FilterResult(NamedTuple):
    """The filtered input and the ψ_m of the barriers there.

    Attributes:
        input: u(k), (n_u,).
        status: "solved"; "softened", where some barrier is missed: those that can be kept are, the others are missed
            by as little as possible, in the filter's order of priority; "failed", where the input is the wanted one,
            clipped to its limits.
        psi: each barrier's ψ_m, evaluated at that input, (n_b,) [unit of its h].
        slack: by how much each ψ_m falls short of its tightening, ≥ 0, (n_b,) [unit of its h]; 0 within rounding.
        reason: a sentence for anything but "solved". "no input satisfies every barrier at once", or "no
            input within its limits ..." where there are limits, is proved by a combination of the rows.
    """

    input: NDArray[np.float64]
    status: Literal["solved", "softened", "failed"]
    psi: NDArray[np.float64]
    slack: NDArray[np.float64]
    reason: str = ""


class Linearisation(NamedTuple):
    """ψ_m ≈ psi + gradient·(u − point), and the length of each gradient."""

    point: Array
    psi: Array
    gradient: Array
    length: Array

    def __call__(self, u: Array) -> Array:
        return self.psi + self.gradient @ (u - self.point)


class _Answer(NamedTuple):
    """An input, ψ_m and its shortfall there, and whether the rows that gave the input are exact at it."""

    input: Array
    psi: Array
    slack: Array
    exact: bool


class BarrierFilter:
    """min_u ‖u − u_wanted‖² subject to ψ_m(k) ≥ tightening for each barrier, and lower ≤ u ≤ upper.

    ψ_m must be affine in u(k), as it is for control-affine dynamics and an h that is affine in the states that the
    input reaches; the class-K functions may be nonlinear, since their arguments do not depend on u(k). Where the
    dynamics clip their input, ψ_m is linearised anew at the answer, until it is exact there.

    Where no input satisfies all rows, the limits hold, a barrier is kept if it can be kept together with those of
    higher priority that are kept, and each other one is missed by as little as possible, in the same order
    (`barriers.priorities`). A common factor on all inputs, on the states, or on one h changes nothing else.

    Args:
        system: the dynamics.
        barriers: one or more, of different names, with different relative degrees and periods if need be: all repeats
            after the least common multiple of the barriers' and the system's periods, such as 120 ticks for 30 and 40.
        lower, upper: limits of the input, (n_u,); None for none.
        tightening: d̄ ≥ 0 [unit of h], one for all barriers: ψ_m ≥ d̄ withstands |d| ≤ d̄ on h(k+m).
        priority: names of barriers, the most important one first; the others follow in the order of `barriers`.
        states: (S, n), states at which h and the dynamics are defined, where they are checked.
        disturbance: w̄, (n,), or one for each tick of a period, (P, n): |w_i| ≤ w̄_i is added to x(k+1) at every tick,
            and h ≥ 0 holds none the less. Each barrier is then its `robust_barrier`, which must be affine on affine
            dynamics.
        estimate: ē, (n,): the states given to the filter err by at most ē, and h ≥ 0 holds for the true ones.
        delay: the age of what they were predicted from, by the inputs sent since [ticks].

    Raises:
        InputError: no barrier, or two of one name; a declared relative degree is not the computed one; ψ_m is not
            affine in the input within its limits; limits that leave no input; a tightening that is negative or not
            finite; or a priority that is no list of different names of barriers.
    """

    def __init__(
        self,
        system: PeriodicSystem,
        barriers: Sequence[Barrier],
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        tightening: float = 0.0,
        priority: Sequence[str] = (),
        states: ArrayLike | None = None,
        disturbance: ArrayLike | None = None,
        estimate: ArrayLike | None = None,
        delay: int = 0,
    ) -> None:
        self.system = check_system(system)
        self.barriers = check_barriers(barriers, system, states)
        if disturbance is not None or estimate is not None:
            self.barriers = tuple(_robust(each, system, disturbance, estimate, delay) for each in self.barriers)
        self.lower = np.full(system.m, -np.inf) if lower is None else number_array("the lower limits", lower)
        self.upper = np.full(system.m, np.inf) if upper is None else number_array("the upper limits", upper)
        self.tightening = finite_number("the tightening", tightening, 0.0)
        fit = self.lower.shape == self.upper.shape == (system.m,) and np.all(self.lower <= self.upper)
        if not (fit and np.all(self.lower < np.inf) and np.all(self.upper > -np.inf)):
            raise InputError(
                f"input limits must be two vectors of {system.m}, lower <= upper, given {lower!r} and {upper!r}"
            )
        self._order = _order([barrier.name for barrier in self.barriers], priority)
        eye, below, above = np.eye(system.m), np.isfinite(self.lower), np.isfinite(self.upper)
        self._limit_rows = np.vstack([eye[below], -eye[above]])
        self._limit_bounds = np.concatenate([self.lower[below], -self.upper[above]]).astype(float)
        self._affine = isinstance(system, PeriodicAffineSystem) and all(
            isinstance(barrier, AffineBarrier) for barrier in self.barriers
        )
        self._excluded = _WITHIN if len(self._limit_rows) else _EXCLUDED
        self._check_inputs(states)

    def _check_inputs(self, states: ArrayLike | None) -> None:
        for barrier in self.barriers:
            check_affine_in_input(barrier, self.system, self.lower, self.upper, "BarrierFilter", states)

    def __call__(self, k: int, x: ArrayLike, wanted: ArrayLike) -> FilterResult:
        """The filtered input at tick k and state x (n,), for the wanted input (n_u,).

        Raises:
            InputError: shapes that do not fit the system. Numbers that are not finite give the status "failed".
        """
        k = whole_ticks("the tick k", k)
        state, target = vector("the state x", x, self.system.n), vector("the wanted input", wanted, self.system.m)
        state, target = state.astype(float), target.astype(float)
        clipped = np.clip(np.nan_to_num(target), self.lower, self.upper)
        unknown = np.full(len(self.barriers), np.nan)
        if not (np.all(np.isfinite(state)) and np.all(np.isfinite(target))):
            return FilterResult(clipped, "failed", unknown, unknown, "the state or the wanted input is not finite")
        try:
            return self._filtered(k, state, target, clipped)
        except Exception as error:  # of a user's function at this state: nothing in a control loop raises
            name = type(error).__name__
            reason = str(error) if isinstance(error, InputError) else f"h or the dynamics raise {name} ({error})"
            return FilterResult(clipped, "failed", unknown, unknown, reason)

    def _filtered(self, k: int, state: Array, target: Array, clipped: Array) -> FilterResult:
        rows = self._rows(k, state, clipped)
        if not (np.all(np.isfinite(rows.psi)) and np.all(np.isfinite(rows.gradient))):
            unknown = np.full(len(self.barriers), np.nan)
            return FilterResult(clipped, "failed", rows.psi, unknown, "a barrier is not finite at this state")
        if np.all(rows.psi >= self.tightening):  # the nearest input within the limits is safe: nothing to solve
            return FilterResult(clipped, "solved", rows.psi, np.zeros(len(rows.psi)))
        return self._search(k, state, target, rows)

    def _search(self, k: int, state: Array, target: Array, rows: Linearisation) -> FilterResult:
        """The answer where the wanted input within its limits, at which `rows` are linearised, is not safe."""
        clipped = rows.point
        answers = list(self._answers(k, state, target, rows))
        exact = bool(answers) and answers[-1].exact
        if not exact or np.any(answers[-1].slack):
            starts = self._starts(clipped)
            # Rows that hold at other inputs too prove that no input satisfies them.
            if not self._affine and self._bends(k, state, rows, [*starts[:2], *(answer.input for answer in answers)]):
                exact = False
                for start in starts:
                    answers += self._answers(k, state, target, self._rows(k, state, start))
        if not answers:
            slack = np.maximum(self.tightening - rows.psi, 0.0)
            return FilterResult(clipped, "failed", rows.psi, slack, "the active-set method did not end")
        best = answers[-1] if exact else min(answers, key=self._rank)
        if not np.any(best.slack):
            return FilterResult(best.input, "solved", best.psi, best.slack)
        return FilterResult(best.input, "softened", best.psi, best.slack, self._excluded if exact else _NOT_AFFINE)

    def _rows(self, k: int, state: Array, point: Array) -> Linearisation:
        """The linear ψ_m at an input."""
        found = [enforced_row(barrier, self.system, k, state, point) for barrier in self.barriers]
        psi, slopes = np.array([value for value, _ in found]), np.array([slope for _, slope in found])
        gradient = slopes.reshape(-1, self.system.m)
        return Linearisation(point, psi, gradient, np.sqrt((gradient * gradient).sum(axis=1)))

    def _answers(self, k: int, state: Array, target: Array, rows: Linearisation) -> Iterator[_Answer]:
        """The answers to `rows` and to those linearised anew at each answer, until ψ_m there is as predicted."""
        for _ in range(_LINEARISATIONS):
            u, lost = self._nearest(k, state, target, rows)
            if u is None:
                return
            psi = enforced_values(self.barriers, self.system, k, state, u)
            error, short = np.abs(psi - rows(u)), np.maximum(self.tightening - psi, 0.0)
            allowed = (_SETTLED * math.sqrt(u @ u)) * rows.length
            if np.all(error <= allowed) and np.all(lost | (short <= _NOTHING * allowed)):
                slack, exact = np.where(lost, short, 0.0), True
            else:
                size = psi_sizes(self.barriers, self.system, k, state, u)
                slack = np.where(short <= rounding_of(size, rows), 0.0, np.where(np.isnan(short), np.inf, short))
                near = np.abs(u - rows.point) <= _SETTLED * (np.abs(u) + np.abs(rows.point))
                exact = bool(np.all(error <= allowed + _ROUNDING * size) or np.all(near))
            yield _Answer(u, psi, slack, exact)
            if exact:
                return
            rows = self._rows(k, state, u)
            if not (np.all(np.isfinite(rows.psi)) and np.all(np.isfinite(rows.gradient))):
                return

    def _nearest(
        self, k: int, state: Array, target: Array, rows: Linearisation, levels: Array | float | None = None
    ) -> tuple[Array | None, NDArray[np.bool_]]:
        """The input nearest to `target` with linear ψ_m ≥ levels, by `nearest_kept`, and which barriers it misses.

        The levels, (n_b,), are the tightening unless given.
        """
        levels = self.tightening if levels is None else levels
        length = rows.length
        with np.errstate(all="ignore"):  # rows without an input are left out
            directions, bounds = rows.gradient / length[:, None], (levels - rows.psi) / length
        usable = np.isfinite(bounds) & (length > 0)
        order = self._order
        if not usable.all():
            places = np.cumsum(usable) - 1
            order = [int(places[row]) for row in order if usable[row]]

        def rounding() -> Array:
            size = psi_sizes(self.barriers, self.system, k, state, rows.point)
            return (rounding_of(size, rows) / length)[usable]

        limits = self._limit_rows, self._limit_bounds - self._limit_rows @ rows.point
        found = nearest_kept(target - rows.point, directions[usable], bounds[usable], limits, order, rounding)
        lost = np.zeros(len(length), dtype=bool)
        if found is None:
            return None, lost
        lost[np.flatnonzero(usable)[found.lost]] = True
        return np.clip(rows.point + found.input, self.lower, self.upper), lost

    def _bends(self, k: int, state: Array, rows: Linearisation, points: list[Array]) -> bool:
        """Whether ψ_m differs from its linear form at one of some inputs."""
        size = psi_sizes(self.barriers, self.system, k, state, rows.point)
        for u in points:
            terms = size + np.abs(rows.gradient) @ np.abs(u - rows.point)
            psi = enforced_values(self.barriers, self.system, k, state, u)
            if not np.all(np.abs(psi - rows(u)) <= _SETTLED * terms):
                return True
        return False

    def _starts(self, clipped: Array) -> list[Array]:
        """Inputs on both sides of the middle of the limits; where dynamics clip their input, some are not clipped."""
        bounded = np.isfinite(self.lower) & np.isfinite(self.upper)
        low, high = np.where(bounded, self.lower, -np.abs(clipped)), np.where(bounded, self.upper, np.abs(clipped))
        middle = np.clip(0.5 * (low + high), self.lower, self.upper)
        shares = (0.0, -1.0, 0.25, 0.5, -0.5)
        return [np.clip(middle + share * (clipped - middle), self.lower, self.upper) for share in shares]

    def _rank(self, answer: _Answer) -> tuple[Any, ...]:
        """Smaller for a better answer: fewer barriers of high priority missed, and by less."""
        slack = answer.slack[self._order]
        return (*(slack > 0), *slack)


def rounding_of(size: Array, rows: Linearisation) -> Array:
    """By how much each ψ_m may fall short because of rounding, its own and that of the answer, (n_b,) [unit of h]."""
    return _ROUNDING * size + (_ROUNDING_OF_INPUT * math.sqrt(rows.point @ rows.point)) * rows.length


def _robust(
    barrier: Barrier, system: PeriodicSystem, disturbance: ArrayLike | None, estimate: ArrayLike | None, delay: int
) -> AffineBarrier:
    if isinstance(barrier, AffineBarrier) and isinstance(system, PeriodicAffineSystem):
        return robust_barrier(barrier, system, disturbance, estimate, delay)
    raise InputError(
        f'barrier "{barrier.name}": a disturbance or an error of the state takes an AffineBarrier on a '
        "PeriodicAffineSystem; for any other give what it can add to h as the tightening"
    )


def _order(names: list[str], priority: Sequence[str]) -> list[int]:
    """The indices of the barriers, the most important one first; raises `InputError`."""
    given = list(priority) if not isinstance(priority, str) and np.iterable(priority) else [None]
    wrong = next((name for i, name in enumerate(given) if name not in names or name in given[:i]), None)
    if wrong is not None or None in given:
        raise InputError(
            f"the priority is a list of different names among {', '.join(names) or 'no barriers'}, "
            f"given {shown(priority)}"
        )
    first = [i for name in given for i, other in enumerate(names) if other == name]
    return [*first, *(i for i in range(len(names)) if i not in first)]
