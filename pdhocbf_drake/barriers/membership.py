"""Is a state in the safe set C_0(k) ∩ … ∩ C_{m−1}(k), eq. (10), from which ψ_m ≥ 0 keeps h ≥ 0?"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pdhocbf_drake.barriers.barrier import Barrier
from pdhocbf_drake.barriers.dynamics import PeriodicSystem, rollout
from pdhocbf_drake.barriers.recursion import psi_along
from pdhocbf_drake.errors import InputError


def initial_psi(barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike) -> dict[str, float]:
    """What must be ≥ 0 at x(k), because no input can change it [unit of h].

    These are ψ_0(k), …, ψ_{m−1}(k); where the relative degree r exceeds m, also ψ_m(k), …, ψ_m(k+r−m−1).
    The keys say which: "psi_0", "psi_1", …, and "psi_1, 1 tick later," for what follows ψ_m(k).
    """
    degree = barrier.relative_degree
    # h up to k+r−1 does not depend on the inputs, so zero inputs do.
    states = rollout(system, k, np.asarray(x, dtype=float), np.zeros((degree - 1, system.m)))
    levels = psi_along([float(barrier.h(k + j, state)) for j, state in enumerate(states)], barrier.class_k)
    values = {f"psi_{i}": float(level[0]) for i, level in enumerate(levels) if len(level)}
    for j, value in enumerate(levels[-1][1:], start=1):
        values[f"psi_{barrier.order}, {j} tick{'s' * (j > 1)} later,"] = float(value)
    return values


def in_safe_set(barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike) -> bool:
    """Whether ψ_i(k) ≥ 0 for all i < m: then ψ_m ≥ 0 from now on keeps h ≥ 0 (Theorem 1)."""
    return all(value >= 0 for value in initial_psi(barrier, system, k, x).values())


def check_in_safe_set(barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike) -> None:
    """Refuses a state outside the safe set.

    Raises:
        InputError: it names the first negative ψ_i and its value.
    """
    values = initial_psi(barrier, system, k, x)
    for which, value in values.items():
        if not value >= 0:  # NaN too
            unit = f" {barrier.unit}" if barrier.unit not in ("", "1") else ""
            raise InputError(
                f'barrier "{barrier.name}": the state at tick {k} is outside the safe set: '
                f"{which} is {value:.6g}{unit}, but at least 0 is needed"
            )
