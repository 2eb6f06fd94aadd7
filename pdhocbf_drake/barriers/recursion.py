"""The ψ recursion, eq. (11): from a barrier h to the one inequality ψ_m(k) ≥ 0 that a controller enforces.

    ψ_0(k) = h(k, x(k)),    ψ_i(k) = ψ_{i−1}(k+1) − ψ_{i−1}(k) + α_i(ψ_{i−1}(k)).

The bound moves: h at k+1 is taken with k+1 in the function as well as in the state.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers.barrier import Barrier
from pdhocbf_drake.barriers.checks import number_array
from pdhocbf_drake.barriers.class_k import ClassK, Linear, as_class_k
from pdhocbf_drake.barriers.dynamics import Array, PeriodicSystem, input_rows, rollout
from pdhocbf_drake.errors import InputError


def psi_from_h(h: Sequence[Any] | Array, class_k: Sequence[ClassK | float]) -> Array:
    """ψ_0(k), …, ψ_r(k), r ≤ m, from h(k), …, h(k+r), eq. (11): floats or AutoDiffXd, shape (r+1,).

    Raises `InputError` if there is no h.
    """
    level = list(h)
    if not level:
        raise InputError("the recursion needs at least one value of h, given none")
    values = [level[0]]
    for alpha in map(as_class_k, class_k[: len(level) - 1]):
        level = [after - now + alpha(now) for now, after in pairwise(level)]
        values.append(level[0])
    return np.array(values)


def psi_along(h: ArrayLike, class_k: Sequence[ClassK | float]) -> list[NDArray[np.float64]]:
    """ψ_0, …, ψ_m along a recorded h of shape (T,); ψ_i has shape (T−i,). Raises `InputError` unless T numbers."""
    values = number_array("a record of h", h)
    if values.ndim != 1:
        raise InputError(f"a record of h is a list of numbers, given shape {values.shape}")
    levels = [values.astype(float)]
    for alpha in map(as_class_k, class_k):
        now = levels[-1]
        # Element by element, because a user's class-K function need not take an array.
        levels.append(now[1:] - now[:-1] + np.array([float(alpha(s)) for s in now[:-1]]))
    return levels


def psi(barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike, inputs: ArrayLike) -> Array:
    """ψ_0(k), …, ψ_m(k), shape (m+1,), from the state x(k) and the inputs u(k), …, u(k+m−1).

    Args:
        inputs: (j, system.m) with j ≤ m; inputs that are left out are zero, without effect where the relative degree
            is m, since then only ψ_m depends on an input, on u(k).

    Raises:
        InputError: shapes that do not fit, or more than m inputs.
    """
    given = input_rows(system, inputs)
    if len(given) > barrier.order:
        raise InputError(
            f'barrier "{barrier.name}": psi_{barrier.order} takes the inputs of {barrier.order} ticks at most, '
            f"given {len(given)}"
        )
    padding = np.zeros((barrier.order - len(given), system.m), dtype=given.dtype)
    states = rollout(system, k, x, np.concatenate([given, padding]))
    return psi_from_h([barrier.h(k + j, state) for j, state in enumerate(states)], barrier.class_k)


def psi_coefficients(gammas: Sequence[float]) -> NDArray[np.float64]:
    """The coefficients c_0, …, c_m of ψ_m(k) = Σ_j c_j h(k+j) for linear class-K functions.

    They are those of Π_i (E − (1−γ_i)) with E the shift by one tick; for m = 2,
    ψ_2(k) = h(k+2) − (2−γ_1−γ_2) h(k+1) + (1−γ_1)(1−γ_2) h(k).
    """
    coefficients = np.ones(1)
    for gamma in gammas:
        coefficients = np.convolve(coefficients, [-(1 - Linear(gamma).gamma), 1.0])
    return coefficients


def linear_rates(barrier: Barrier) -> tuple[float, ...]:
    """γ_1, …, γ_m of a barrier; raises `InputError` if a class-K function is not linear, and its rows not affine."""
    rates = []
    for i, alpha in enumerate(barrier.class_k, start=1):
        if not isinstance(alpha, Linear):
            raise InputError(
                f'barrier "{barrier.name}": class-K function {i} is {alpha!r}, but affine rows need linear ones; '
                "add_nonlinear_barrier_rows takes any"
            )
        rates.append(alpha.gamma)
    return tuple(rates)
