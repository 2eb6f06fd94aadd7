"""The largest sets in which a periodic affine system can be kept for ever, under limits on its state and input.

They show whether a bound is enforceable at all, which its ψ rows alone do not.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.flat import Rows, flat_predecessor, positive, step_rows
from pdhocbf_drake.sets.polytope import THINNEST, Array, Polytope, bounding_box, support

_LOOSE = 1e-3  # share of its limits below which a state's extent is no longer resolved well
_FIXED = 1e-12  # share of what one tick makes of a state below which its extent is rounding
_ROUNDING = 1e-13  # share of its terms below which an entry of a computed row is 0


@dataclass(frozen=True)
class InvariantSet:
    """The maximal periodic controlled-invariant set C_0, …, C_{N−1}:

        C_k = X_k ∩ Pre_k(C_{k+1} ⊖ W_k),   C_{k+N} = C_k,
        Pre_k(C) = {x : A_k x + B_k u + c_k ∈ C for some u ∈ U_k},   C ⊖ W = {x : x + w ∈ C for all w ∈ W}.

    From x(k) ∈ C_k some admissible inputs, each chosen for the state of its tick, keep x(j) ∈ X_j for all j ≥ k
    whatever the disturbances w(j) ∈ W_j are; and from any other state some disturbances prevent it, whatever the inputs
    are. Both hold up to `residual`, since the iteration is finite. Without disturbances W_k = {0}.

    Attributes:
        sets: C_k, one per phase; empty if there is no such set.
        first_failing_phase: the phase at which, going backward in time, no state was left; None if there is a set.
        sweeps: passes around the cycle.
        residual: the largest distance of a vertex of some C_k from Pre_k(C_{k+1} ⊖ W_k), of the order of the tolerance
            at which the iteration stops, where half the extent of the limits is the unit of each state [1]; NaN if
            there is no set.
        seconds: wall time.
    """

    sets: tuple[Polytope, ...]
    first_failing_phase: int | None
    sweeps: int
    residual: float
    seconds: float

    @property
    def enforceable(self) -> bool:
        """Whether some states can be kept within the limits for ever, up to `residual`."""
        return self.first_failing_phase is None


def predecessor_rows(system: PeriodicAffineSystem, k: int, target: Polytope, inputs: Polytope) -> Rows:
    """Pre_k(target) as rows (A, b): A_k x + c_k ∈ target ⊕ (−B_k U_k), where A_k may be singular."""
    reach = target.swept(np.unique(-(inputs.vertices @ system.B(k).T), axis=0))
    size = np.linalg.norm(reach.A * target.unit, axis=1)[:, None]
    normals = reach.A / size
    rows, bounds = normals @ system.A(k), reach.b / size[:, 0] - normals @ system.c(k)
    rows[np.abs(rows) <= _ROUNDING * (np.abs(normals) @ np.abs(system.A(k)))] = 0.0
    bounds[~np.any(rows, axis=1) & (np.abs(bounds) <= THINNEST)] = 0.0  # true or false anywhere, but for rounding
    return rows, bounds


def invariant_set(
    system: PeriodicAffineSystem,
    states: Sequence[Polytope | None],
    inputs: Sequence[Polytope],
    tolerance: float = 1e-9,
    max_sweeps: int = 500,
    disturbance: Sequence[Array] = (),
    within: Sequence[Polytope] = (),
) -> InvariantSet:
    """Runs C_k ← X_k ∩ Pre_k(C_{k+1} ⊖ W_k) backward around the cycle from C_k = X_k until nothing changes.

    Args:
        system: x(k+1) = A_k x + B_k u + c_k of period N; a time-invariant one has the period of its limits.
        states: X_k, N of them or one; None for an empty one, with which there is no invariant set. Where one is flat,
            as a box with a fixed state is, the equations that it makes within n sweeps leave flat sets. A set without
            an interior, or one within what they leave, counts as none.
        inputs: U_k, N of them or one, flat or not.
        tolerance: a sweep that cuts off less than this anywhere is the last one, where half the extent of the limits
            is the unit of each state [1].
        max_sweeps: largest number of passes around the cycle.
        disturbance: points whose hull is W_k, each (w, n), N of them or one, in x(k+1) = A_k x + B_k u + c_k + w; none
            for an undisturbed system.
        within: the sets under a smaller disturbance, from which the iteration then starts; they hold those under a
            larger one.

    Raises:
        InputError: sizes that do not fit; or no fixed point within the sweeps.
    """
    system = _with_period(system, max(len(states), len(inputs), len(disturbance)))
    period = system.period
    present = [part for part in states if part is not None]
    if len(present) < len(states):
        return InvariantSet((), states.index(None), 0, np.nan, 0.0)
    limits = _one_per_phase(present, period, system.n, "state")
    allowed = _one_per_phase(inputs, period, system.m, "input")
    problem = _Problem(system, limits, allowed, tolerance, max_sweeps, _disturbances(disturbance, period, system.n))
    if any(part.rank < system.n for part in limits):
        return problem.solve(problem.tight_unit(), flat=True)
    if within:
        return problem.solve(np.stack([part.unit for part in within]).max(axis=0), within=within)
    unit = np.stack([part.unit for part in limits]).max(axis=0)
    found = problem.solve(unit)
    if found.sets and np.all(np.max([part.unit for part in found.sets], axis=0) > _LOOSE * unit):
        return found
    tight = problem.tight_unit()  # a limit that others imply is no unit
    return problem.solve(tight) if np.any(tight < _LOOSE * unit) else found


@dataclass(frozen=True)
class _Problem:
    system: PeriodicAffineSystem
    limits: tuple[Polytope, ...]
    inputs: tuple[Polytope, ...]
    tolerance: float
    max_sweeps: int
    disturbances: tuple[Array, ...] | None

    def solve(self, unit: Array, flat: bool = False, within: Sequence[Polytope] = ()) -> InvariantSet:
        """The invariant set; `unit` is that of each state, in which the tolerance and `THINNEST` are meant."""
        started = time.perf_counter()
        period, sets = self.system.period, list(within or self.limits)
        cut = self._cut_flat if flat else self._cut
        stale = np.ones(period, dtype=bool)  # phases whose next set has changed since they were computed
        residual = np.zeros(period)
        for sweep in range(1, self.max_sweeps + 1):
            largest = 0.0
            for k in reversed(range(period)):
                if not stale[k]:
                    continue
                excess, smaller = cut(k, sets[k], sets[(k + 1) % period], unit)
                stale[k], residual[k], largest = False, max(excess, 0.0), max(largest, excess)
                if excess <= self.tolerance:
                    continue
                if smaller is None or (flat and sweep > self.system.n and smaller.rank < sets[k].rank):
                    return InvariantSet((), k, sweep, np.nan, time.perf_counter() - started)
                sets[k], residual[k] = smaller, 0.0
                stale[k - 1] = True
            if not stale.any():
                seconds = time.perf_counter() - started
                return InvariantSet(tuple(sets), None, sweep, float(residual.max()), seconds)
        raise InputError(
            f"no invariant set was found within {self.max_sweeps} sweeps (the last one still cut off {largest:.1e}): "
            "allow more of them or a larger tolerance"
        )

    def _cut(self, k: int, here: Polytope, following: Polytope, unit: Array) -> tuple[float, Polytope | None]:
        """By how much C_k lies outside Pre_k(C_{k+1}), and what is left of it; None where nothing is."""
        target = following if self.disturbances is None else following.less(self.disturbances[k], unit)
        if target is None:
            return np.inf, None
        rows, bounds = predecessor_rows(self.system, k, target, self.inputs[k])
        excess = _excess(here, rows, bounds, unit)
        if excess <= self.tolerance:
            return excess, here
        all_rows, all_bounds = np.vstack([self.limits[k].A, rows]), np.concatenate([self.limits[k].b, bounds])
        return excess, Polytope.from_rows(all_rows, all_bounds, here.centre, unit)

    def _cut_flat(self, k: int, here: Polytope, following: Polytope, unit: Array) -> tuple[float, Polytope | None]:
        """The same for sets that may be flat."""
        shift = 0.0 if self.disturbances is None else support(following.A, self.disturbances[k])
        target = (following.A, following.b - shift)
        left = flat_predecessor(self.system, k, self.limits[k], self.inputs[k], target, unit)
        return (np.inf, None) if left is None else (_excess(here, left.A, left.b, unit), left)

    def tight_unit(self) -> Array:
        """Half the extent of the limits of each state, (n,), where limits that others imply are tightened.

        What is demanded of a state some ticks on limits the others now: a position, the velocity. So the boxes around

            {x ∈ X_k : A_k x + B_k u + c_k ∈ the box of phase k + 1 for some u ∈ U_k}

        are computed backward for as many ticks as there are states, from those around X_k. The extent of a fixed state
        is that of what one tick makes of it.
        """
        n, period = self.system.n, self.system.period
        boxes = [Polytope.box(part.vertices.min(axis=0), part.vertices.max(axis=0)) for part in self.limits]
        ones = np.ones(n)
        for _ in range(n):
            for k in reversed(range(period)):
                following = boxes[(k + 1) % period]
                rows = step_rows(self.system, k, self.limits[k], self.inputs[k], (following.A, following.b), ones)
                box = bounding_box(*rows)
                if box is None:  # the sweeps will find it out
                    continue
                boxes[k] = Polytope.box(box[0][:n], np.maximum(box[0], box[1])[:n])
        unit = np.max([box.unit for box in boxes], axis=0)
        made = [self._after(k, boxes[k]) for k in range(period)]
        change = np.max([0.5 * np.ptp(part, axis=0) for part in made], axis=0)
        largest = np.max([np.abs(part).max(axis=0) for part in made], axis=0)
        return positive(np.where(unit > _FIXED * change, unit, change), largest)

    def _after(self, k: int, box: Polytope) -> Array:
        """A_k x + B_k u + c_k at the corners of a box of x and of the limits of u, (v, n)."""
        states, inputs = box.vertices @ self.system.A(k).T, self.inputs[k].vertices @ self.system.B(k).T
        return np.concatenate([states + each for each in inputs]) + self.system.c(k)


def _excess(part: Polytope, rows: Array, bounds: Array, unit: Array) -> float:
    """The largest distance of a vertex beyond a row, in the unit of each state."""
    size = np.maximum(np.linalg.norm(rows * unit, axis=1), THINNEST)  # a row of zeros holds anywhere or nowhere
    return float(((part.vertices @ rows.T - bounds) / size).max())


def broken_phases(
    system: PeriodicAffineSystem,
    parts: Sequence[Polytope | None],
    inputs: Sequence[Polytope],
    disturbance: Sequence[Array] = (),
) -> tuple[int, ...]:
    """Phases k at which C_k ⊄ Pre_k(C_{k+1} ⊖ W_k): from some state of C_k no admissible input leads into C_{k+1}.

    Args:
        system: x(k+1) = A_k x + B_k u + c_k of period N.
        parts: C_k, one per phase; None for an empty one, which breaks its own phase and the one before.
        inputs: U_k, one per phase.
        disturbance: as in `invariant_set`.
    """
    broken = []
    disturbances = _disturbances(disturbance, system.period, system.n)
    for k, here in enumerate(parts):
        there = parts[(k + 1) % system.period]
        if there is not None and disturbances is not None:
            there = there.less(disturbances[k])
        if here is not None and there is not None:
            rows, bounds = predecessor_rows(system, k, there, inputs[k])
            if _excess(here, rows, bounds, here.unit) <= THINNEST:
                continue
        broken.append(k)
    return tuple(broken)


def _with_period(system: PeriodicAffineSystem, period: int) -> PeriodicAffineSystem:
    """A time-invariant system as one of that period; any other as it is."""
    if system.period > 1 or period <= 1:
        return system
    return PeriodicAffineSystem([system.A(0)] * period, [system.B(0)] * period, [system.c(0)] * period)


def _one_per_phase(given: Sequence[Polytope], period: int, size: int, what: str) -> tuple[Polytope, ...]:
    if len(given) not in (1, period):
        raise InputError(f"the {what} limits need 1 polytope or one for each of {period} phases, given {len(given)}")
    if wrong := [p.dimension for p in given if p.dimension != size]:
        raise InputError(f"the {what} limits must have {size} dimensions, given {wrong[0]}")
    return tuple(given) * (period if len(given) == 1 else 1)


def _disturbances(given: Sequence[Array], period: int, size: int) -> tuple[Array, ...] | None:
    """W_k as points for every phase; None where no point differs from 0."""
    parts = [np.asarray(points, dtype=float) for points in given]
    if not any(map(np.any, parts)):
        return None
    if len(parts) not in (1, period) or any(part.ndim != 2 or part.shape[1] != size for part in parts):
        raise InputError(f"a disturbance is points of {size} numbers, once or for each of {period} phases")
    return tuple(parts) * (period if len(parts) == 1 else 1)
