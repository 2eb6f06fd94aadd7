"""Relative degree per phase, computed from the dynamics: after how many ticks u(k) shows in h (Definition 1).

It depends on the input: for the CoM velocity of the VHIP it is 1 with the ZMP's position as input, and 2 with
its velocity (Remark 4). So it is never assumed.
"""

from __future__ import annotations

from math import lcm

import numpy as np
from numpy.typing import ArrayLike

from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
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
        InputError: the dynamics or h cannot take AutoDiffXd.
    """
    if isinstance(barrier, AffineBarrier) and isinstance(system, PeriodicAffineSystem):
        return _from_matrices(barrier, system, phase)
    random = np.random.default_rng(0)
    points = random.standard_normal((_SAMPLES, system.n)) if states is None else np.atleast_2d(np.asarray(states))
    inputs = random.standard_normal((len(points), system.m))
    for ticks in (system.n, system.n * system.period):  # the second only if the first, which is usual, finds none
        found: list[int] = []
        for x, u in zip(points, inputs, strict=True):
            gradient = np.abs(h_sensitivity(barrier, system, phase, x, u, ticks).gradient)
            shows = np.flatnonzero(gradient.max(axis=1) > _ROUNDING * gradient.max())
            found.extend(int(r) for r in shows[:1])
        if found:
            return min(found)
    return None


def _from_matrices(barrier: AffineBarrier, system: PeriodicAffineSystem, phase: int) -> int | None:
    reach, magnitude = system.B(phase), np.abs(system.B(phase))
    # By Cayley-Hamilton on the map over a whole period, what does not show in n periods never does.
    for r in range(1, system.n * system.period + 1):
        if np.any(np.abs(barrier.normal @ reach) > _ROUNDING * (np.abs(barrier.normal) @ magnitude)):
            return r
        A = system.A(phase + r)
        reach, magnitude = A @ reach, np.abs(A) @ magnitude
    return None


def check_relative_degree(
    barrier: Barrier, system: PeriodicSystem, states: ArrayLike | None = None
) -> tuple[int | None, ...]:
    """The relative degree at every phase, which must be the declared one.

    Raises:
        InputError: it is not; the message names the declared and the computed one.
    """
    # The bound does not matter to how an affine barrier depends on x.
    phases = system.period if isinstance(barrier, AffineBarrier) else lcm(system.period, barrier.period)
    computed = tuple(relative_degree(barrier, system, phase, states) for phase in range(phases))
    wrong = [phase for phase, degree in enumerate(computed) if degree != barrier.relative_degree]
    if wrong:
        degree = computed[wrong[0]]
        where = "every phase" if len(set(computed)) == 1 else f"phase {wrong[0]}"
        what = "the input never shows in h" if degree is None else f"the dynamics give {degree}"
        raise InputError(
            f'barrier "{barrier.name}": relative degree {barrier.relative_degree} is declared, but {what} (at {where})'
        )
    return computed
