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
from pdhocbf_drake.sets.polytope import THINNEST, Array, Polytope

Rows = tuple[Array, Array]

_ROUNDING = 1e-13  # share of its terms below which an entry of a computed row is 0


@dataclass(frozen=True)
class InvariantSet:
    """The maximal periodic controlled-invariant set C_0, …, C_{N−1}:

        C_k = X_k ∩ Pre_k(C_{k+1}),   Pre_k(C) = {x : A_k x + B_k u + c_k ∈ C for some u ∈ U_k},   C_{k+N} = C_k.

    From x(k) ∈ C_k some admissible inputs keep x(j) ∈ X_j for all j ≥ k, and from any other state none do; both hold
    up to `residual`, since the iteration is finite.

    Attributes:
        sets: C_k, one per phase; empty if there is no such set.
        first_failing_phase: the phase at which, going backward in time, no state was left; None if there is a set.
        sweeps: passes around the cycle.
        residual: the largest distance of a vertex of some C_k from Pre_k(C_{k+1}), of the order of the tolerance at
            which the iteration stops, where half the extent of the limits is the unit of each state [1]; NaN if there
            is no set.
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
) -> InvariantSet:
    """Runs C_k ← X_k ∩ Pre_k(C_{k+1}) backward around the cycle from C_k = X_k until nothing changes.

    Args:
        system: x(k+1) = A_k x + B_k u + c_k of period N.
        states: X_k, N of them or one; None for an empty one, with which there is no invariant set.
        inputs: U_k, N of them or one.
        tolerance: a sweep that cuts off less than this anywhere is the last one, where half the extent of the limits
            is the unit of each state [1].
        max_sweeps: largest number of passes around the cycle.

    Raises:
        InputError: sizes that do not fit; or no fixed point within the sweeps.
    """
    started = time.perf_counter()
    period = system.period
    present = [part for part in states if part is not None]
    if len(present) < len(states):
        return InvariantSet((), states.index(None), 0, np.nan, 0.0)
    limits = _one_per_phase(present, period, system.n, "state")
    allowed = _one_per_phase(inputs, period, system.m, "input")
    sets, unit = list(limits), np.max([part.unit for part in limits], axis=0)
    stale = np.ones(period, dtype=bool)  # phases whose next set has changed since they were computed
    residual = np.zeros(period)
    for sweep in range(1, max_sweeps + 1):
        cut = 0.0
        for k in reversed(range(period)):
            if not stale[k]:
                continue
            rows, bounds = predecessor_rows(system, k, sets[(k + 1) % period], allowed[k])
            size = np.maximum(np.linalg.norm(rows * unit, axis=1), THINNEST)  # a row of zeros holds anywhere or nowhere
            excess = float(((sets[k].vertices @ rows.T - bounds) / size).max())
            stale[k], residual[k], cut = False, max(excess, 0.0), max(cut, excess)
            if excess <= tolerance:
                continue
            smaller = Polytope.from_rows(
                np.vstack([limits[k].A, rows]), np.concatenate([limits[k].b, bounds]), sets[k].centre, unit
            )
            if smaller is None:
                return InvariantSet((), k, sweep, np.nan, time.perf_counter() - started)
            sets[k], residual[k] = smaller, 0.0
            stale[k - 1] = True
        if not stale.any():
            return InvariantSet(tuple(sets), None, sweep, float(residual.max()), time.perf_counter() - started)
    raise InputError(
        f"no invariant set was found within {max_sweeps} sweeps (the last one still cut off {cut:.1e}): "
        "allow more of them or a larger tolerance"
    )


def broken_phases(
    system: PeriodicAffineSystem, parts: Sequence[Polytope | None], inputs: Sequence[Polytope]
) -> tuple[int, ...]:
    """Phases k at which C_k ⊄ Pre_k(C_{k+1}): from some state of C_k no admissible input leads into C_{k+1}.

    Args:
        system: x(k+1) = A_k x + B_k u + c_k of period N.
        parts: C_k, one per phase; None for an empty one, which breaks its own phase and the one before.
        inputs: U_k, one per phase.
    """
    broken = []
    for k, here in enumerate(parts):
        there = parts[(k + 1) % system.period]
        if here is not None and there is not None:
            rows, bounds = predecessor_rows(system, k, there, inputs[k])
            size = np.maximum(np.linalg.norm(rows * here.unit, axis=1), THINNEST)
            if ((here.vertices @ rows.T - bounds) / size).max() <= THINNEST:
                continue
        broken.append(k)
    return tuple(broken)


def _one_per_phase(given: Sequence[Polytope], period: int, size: int, what: str) -> tuple[Polytope, ...]:
    if len(given) not in (1, period):
        raise InputError(f"the {what} limits need 1 polytope or one for each of {period} phases, given {len(given)}")
    if wrong := [p.dimension for p in given if p.dimension != size]:
        raise InputError(f"the {what} limits must have {size} dimensions, given {wrong[0]}")
    return tuple(given) * (period if len(given) == 1 else 1)
