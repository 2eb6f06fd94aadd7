"""How the first input that matters shows in a barrier: h(k), …, h(k+r) and ψ_m with their derivatives in u(k).

The derivatives come from Drake's AutoDiffXd, so they are exact; dynamics and h must be written with operators
and NumPy functions.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.autodiffutils import InitializeAutoDiff

from pdhocbf_drake.barriers.barrier import Barrier
from pdhocbf_drake.barriers.checks import vector
from pdhocbf_drake.barriers.dynamics import Array, PeriodicSystem, rollout
from pdhocbf_drake.barriers.recursion import psi_from_h
from pdhocbf_drake.errors import InputError


class Sensitivity(NamedTuple):
    """A quantity along the ticks and its derivative in u(k).

    Attributes:
        value: (r+1,) [unit of h].
        gradient: (r+1, n_u) [unit of h / unit of u].
    """

    value: NDArray[np.float64]
    gradient: NDArray[np.float64]


def h_sensitivity(
    barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike, u: ArrayLike, ticks: int
) -> Sensitivity:
    """h(k), …, h(k+r) with r = `ticks`, and their derivatives in u(k); later inputs are zero.

    Raises:
        InputError: the dynamics or h cannot take AutoDiffXd.
    """
    h = _differentiated_h(barrier, system, k, x, u, ticks)
    return Sensitivity(np.array([_value(e) for e in h]), np.array([_gradient(e, system.m) for e in h]))


def enforced_psi(
    barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike, u: ArrayLike
) -> tuple[float, NDArray[np.float64]]:
    """ψ_m(k+r−m), the first ψ_m that u(k) shows in, and its derivative in u(k), shape (n_u,).

    With the relative degree r = m this is ψ_m(k).

    Raises:
        InputError: the dynamics or h cannot take AutoDiffXd.
    """
    h = _differentiated_h(barrier, system, k, x, u, barrier.relative_degree)
    last = psi_from_h(h[barrier.relative_degree - barrier.order :], barrier.class_k)[-1]
    return _value(last), _gradient(last, system.m)


def _differentiated_h(
    barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike, u: ArrayLike, ticks: int
) -> list[Any]:
    first = InitializeAutoDiff(vector("the input u", u, system.m).astype(float)).ravel()
    later = np.zeros((ticks - 1, system.m), dtype=object)
    inputs: Array = np.concatenate([first[np.newaxis], later])
    try:
        states = rollout(system, k, x, inputs)
        return [barrier.h(k + j, state) for j, state in enumerate(states)]
    except (TypeError, AttributeError) as error:
        raise InputError(
            f'barrier "{barrier.name}": the dynamics or h cannot take AutoDiffXd ({error}); '
            "write them with operators and NumPy functions"
        ) from error


def _value(entry: Any) -> float:
    return float(entry.value() if hasattr(entry, "derivatives") else entry)


def _gradient(entry: Any, size: int) -> NDArray[np.float64]:
    derivatives = entry.derivatives() if hasattr(entry, "derivatives") else np.zeros(0)
    return np.asarray(derivatives, dtype=float) if len(derivatives) else np.zeros(size)
