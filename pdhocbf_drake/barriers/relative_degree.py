"""Relative degree per phase, computed from the dynamics: after how many ticks u(k) shows in h (Definition 1).

It depends on the input: for the CoM velocity of the VHIP it is 1 with the ZMP's position as input, and 2 with
its velocity (Remark 4). So it is never assumed.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import lcm

import numpy as np
from numpy.typing import ArrayLike

from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.checks import finite_array, whole_ticks
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem
from pdhocbf_drake.barriers.sensitivity import h_sensitivity
from pdhocbf_drake.errors import InputError

# Below this share of the terms that were summed, a derivative is their rounding error.
_ROUNDING = 1e-12
_SAMPLES = 4


def relative_degree(
    barrier: Barrier, system: PeriodicSystem, phase: int, states: ArrayLike | None = None
) -> int | None:
    """The smallest r ≥ 1 for which h(k+r) depends on u(k), k = `phase`; None if u(k) never shows in h.

    For an affine barrier on affine dynamics: the first r with n·A_{k+r−1}···A_{k+1}·B_k ≠ 0, exactly. Otherwise by
    automatic differentiation at some states, up to r = n·N: what holds at almost all states.

    Args:
        states: (S, n), where to differentiate; by default four drawn from a standard normal distribution.

    Raises:
        InputError: the dynamics or h cannot take AutoDiffXd; h is finite at none of the states; or the states or the
            barrier's normal have another size than the system's state.
    """
    phase = whole_ticks("the phase", phase)
    if isinstance(barrier, AffineBarrier) and isinstance(system, PeriodicAffineSystem):
        return _from_matrices(barrier, system, [phase])[0]
    random = np.random.default_rng(0)
    points = random.standard_normal((_SAMPLES, system.n)) if states is None else finite_array("the states", states)
    if points.ndim != 2 or points.shape[1] != system.n or not len(points):
        raise InputError(f"the states must have shape (S, {system.n}), given {points.shape}")
    inputs = random.standard_normal((len(points), system.m))
    known = False
    for reach in (system.n, system.n * system.period):  # the second only if the first, which is usual, finds none
        found: list[int] = []
        for x, u in zip(points, inputs, strict=True):
            h, slopes = h_sensitivity(barrier, system, phase, x, u, reach)
            if not (np.all(np.isfinite(h)) and np.all(np.isfinite(slopes))):
                continue  # not a state at which h says anything
            known, gradient = True, np.abs(slopes)
            shows = np.flatnonzero(gradient.max(axis=1) > _ROUNDING * gradient.max())
            found.extend(int(r) for r in shows[:1])
        if found:
            return min(found)
    if not known:
        raise InputError(
            f'barrier "{barrier.name}": h or its derivative in the input is not finite at the {len(points)} states '
            "tried; give check_relative_degree states at which they are"
        )
    return None


def _from_matrices(barrier: AffineBarrier, system: PeriodicAffineSystem, phases: Sequence[int]) -> list[int | None]:
    """All phases at once, because rows check it each time they are added."""
    barrier.check_fits(system.n)
    found = np.zeros(len(phases), dtype=int)
    reach = np.stack([system.B(phase) for phase in phases])
    magnitude = np.abs(reach)
    # By Cayley-Hamilton on the map over a whole period, what does not show in n periods never does.
    for r in range(1, system.n * system.period + 1):
        shows = np.any(np.abs(barrier.normal @ reach) > _ROUNDING * (np.abs(barrier.normal) @ magnitude), axis=-1)
        found[shows & (found == 0)] = r
        if found.all():
            break
        A = np.stack([system.A(phase + r) for phase in phases])
        reach, magnitude = A @ reach, np.abs(A) @ magnitude
    return [int(r) or None for r in found]


def check_relative_degree(
    barrier: Barrier, system: PeriodicSystem, states: ArrayLike | None = None
) -> tuple[int | None, ...]:
    """The relative degree at every phase, which must be the declared one.

    Raises:
        InputError: it is not; the message names the declared and the computed one.
    """
    # The bound does not matter to how an affine barrier depends on x.
    phases = range(system.period if isinstance(barrier, AffineBarrier) else lcm(system.period, barrier.period))
    if isinstance(barrier, AffineBarrier) and isinstance(system, PeriodicAffineSystem):
        computed = tuple(_from_matrices(barrier, system, phases))
    else:
        computed = tuple(relative_degree(barrier, system, phase, states) for phase in phases)
    wrong = [phase for phase, degree in enumerate(computed) if degree != barrier.relative_degree]
    if wrong:
        degree = computed[wrong[0]]
        where = "every phase" if len(set(computed)) == 1 else f"phase {wrong[0]}"
        what = "the input never shows in h" if degree is None else f"the dynamics give {degree}"
        declared, count = barrier.relative_degree, barrier.order
        by = f" by {count} class-K function{'s' * (count > 1)}" if declared == count else ""
        raise InputError(
            f'barrier "{barrier.name}": relative degree {declared} is declared{by}, but {what} (at {where})'
        )
    return computed
