"""The relative degree of a barrier (Definition 1), and the derivative of its ψ_m in the input u(k).

The relative degree depends on the choice of the input: for the position of a cart it is smaller with the velocity as
input than with the acceleration (compare Remark 4). So it is computed from the dynamics for each phase. Derivatives
come from Drake's AutoDiffXd and are exact; dynamics and h must be written with operators and NumPy functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import lcm
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.autodiffutils import InitializeAutoDiff

from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.checks import finite_array, shown, vector, whole_ticks
from pdhocbf_drake.barriers.dynamics import Array, PeriodicAffineSystem, PeriodicSystem, check_system, rollout
from pdhocbf_drake.barriers.periodicity import check_step_repeats
from pdhocbf_drake.barriers.recursion import psi_from_h
from pdhocbf_drake.errors import InputError

# A derivative below this share of its summed terms is their rounding error.
_ROUNDING = 1e-12
_SAMPLES = 4
_STEP = 2.0**-20  # share of a state or input, for a difference quotient


def relative_degree(
    barrier: Barrier, system: PeriodicSystem, phase: int, states: ArrayLike | None = None
) -> int | None:
    """The smallest r ≥ 1 for which h(k+r) depends on u(k), k = `phase`; None if no h does.

    For an affine barrier on affine dynamics it is the first r with n_{k+r}·A_{k+r−1}···A_{k+1}·B_k ≠ 0. Otherwise it is
    found by automatic differentiation at some states, up to r = n·N, and holds at almost all states.

    Args:
        states: (S, n), where to differentiate; by default four drawn from a standard normal distribution.

    Raises:
        InputError: the dynamics or h cannot take AutoDiffXd, do not repeat with their period, or give no state and no
            number; h is finite at none of the states; the states or the barrier's normal have another size than the
            system's state; or the system lacks a part.
    """
    check_system(system)
    phase = whole_ticks("the phase", phase)
    if isinstance(barrier, AffineBarrier) and isinstance(system, PeriodicAffineSystem):
        return _from_matrices(barrier, system, [phase])[0]
    random = np.random.default_rng(0)
    points = random.standard_normal((_SAMPLES, system.n)) if states is None else finite_array("the states", states)
    if points.ndim != 2 or points.shape[1] != system.n or not len(points):
        raise InputError(f"the states must have shape (S, {system.n}), given {points.shape}")
    inputs = random.standard_normal((len(points), system.m))
    if not isinstance(system, PeriodicAffineSystem):
        origin = np.zeros((1, system.n + system.m))  # where nothing hides what depends on the tick alone
        sampled = np.vstack([origin, np.hstack([points[:2], inputs[:2]])])
        check_step_repeats(system, phase, sampled[:, : system.n], sampled[:, system.n :])
    defined = False
    for reach in (system.n, system.n * system.period):  # the second only if the first, which is usual, finds none
        found: list[int] = []
        for x, u in zip(points, inputs, strict=True):
            along = _differentiated_h(barrier, system, phase, x, u, reach)
            h, slopes = [_value(e) for e in along], np.array([_gradient(e, system.m) for e in along])
            if not (np.all(np.isfinite(h)) and np.all(np.isfinite(slopes))):
                continue  # h is not defined at this state
            defined, gradient = True, np.abs(slopes)
            depends = np.flatnonzero(gradient.max(axis=1) > _ROUNDING * gradient.max())
            found.extend(int(r) for r in depends[:1])
        if found:
            return min(found)
    if not defined:
        raise InputError(
            f'barrier "{barrier.name}": h or its derivative in the input is not finite at the {len(points)} states '
            "tried; give states at which they are"
        )
    return None


def check_relative_degree(
    barrier: Barrier, system: PeriodicSystem, states: ArrayLike | None = None
) -> tuple[int | None, ...]:
    """The relative degree at every phase, which may take a millisecond each unless barrier and system are affine.

    Raises:
        InputError: as `relative_degree`; at some phase the relative degree is not the declared one, with both of them;
            or h or the dynamics do not repeat with their period.
    """
    return check_degrees(barrier, system, phases_of(barrier, check_system(system)), states)


def check_degrees(
    barrier: Barrier, system: PeriodicSystem, phases: Sequence[int], states: ArrayLike | None = None
) -> tuple[int | None, ...]:
    """`check_relative_degree` at these phases alone."""
    check_system(system)
    if isinstance(barrier, AffineBarrier) and isinstance(system, PeriodicAffineSystem):
        computed = tuple(_from_matrices(barrier, system, phases))
    else:
        computed = tuple(relative_degree(barrier, system, phase, states) for phase in phases)
    wrong = [i for i, degree in enumerate(computed) if degree != barrier.relative_degree]
    if wrong:
        degree = computed[wrong[0]]
        every = len(set(computed)) == 1 and len(phases) == len(phases_of(barrier, system))
        where = "every phase" if every else f"phase {phases[wrong[0]]}"
        what = "the input never shows in h" if degree is None else f"the dynamics give {degree}"
        declared, count = barrier.relative_degree, barrier.order
        by = f" by {count} class-K function{'s' * (count > 1)}" if declared == count else ""
        raise InputError(
            f'barrier "{barrier.name}": relative degree {declared} is declared{by}, but {what} (at {where})'
        )
    return computed


def phases_of(barrier: Barrier, system: PeriodicSystem) -> range:
    """Phases 0, 1, … after which the derivatives of h along the dynamics repeat; the bound of an affine h has none."""
    of_barrier = barrier.normal_period if isinstance(barrier, AffineBarrier) else barrier.period
    return range(lcm(system.period, of_barrier))


def enforced_psi(
    barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike, u: ArrayLike
) -> tuple[float, NDArray[np.float64]]:
    """ψ_m(k+r−m), the first ψ_m that depends on u(k), and its derivative in u(k), shape (n_u,).

    With the relative degree r = m this is ψ_m(k).

    Raises:
        InputError: as `relative_degree`, which is compared with the declared one at tick k in each call; or shapes that
            do not fit.
    """
    check_system(system)
    check_degrees(barrier, system, [whole_ticks("the tick k", k)], with_samples(vector("the state x", x, system.n)))
    return enforced_row(barrier, system, k, x, u)


def enforced_row(
    barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike, u: ArrayLike
) -> tuple[float, NDArray[np.float64]]:
    """`enforced_psi` without a check of the relative degree, for loops."""
    h = _differentiated_h(barrier, system, k, x, u, barrier.relative_degree)[barrier.relative_degree - barrier.order :]
    # No h before the last one depends on u(k); as floats they suit class-K functions that can't take AutoDiffXd.
    last = psi_from_h([*map(_value, h[:-1]), h[-1]], barrier.class_k)[-1]
    return _value(last), _gradient(last, system.m)


def with_samples(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The state at hand and the states that `relative_degree` takes by default, (1 + S, n)."""
    return np.vstack([x, np.random.default_rng(0).standard_normal((_SAMPLES, len(x)))])


def enforced_values(
    barriers: Sequence[Barrier], system: PeriodicSystem, k: int, x: NDArray[np.float64], u: NDArray[np.float64]
) -> NDArray[np.float64]:
    """ψ_m of `enforced_psi` for each barrier, (n_b,), along one rollout of floats."""
    along = _along(barriers, system, k, x, u)
    return np.array([psi_from_h(h, b.class_k)[-1] for h, b in zip(along, barriers, strict=True)], dtype=float)


def psi_sizes(
    barriers: Sequence[Barrier], system: PeriodicSystem, k: int, x: NDArray[np.float64], u: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The size of the terms that each ψ_m is a difference of, which its rounding is a share of, (n_b,) [unit of h].

    It is max_j |h(k+j)| + |∂h(k+j)/∂ log(x, u)|, the latter from one step in a generic direction.
    """
    generic = 1 + _STEP * np.sin(np.arange(1.0, system.n + system.m + 1.0) ** 2)  # no two entries move alike
    there = _along(barriers, system, k, x * generic[: system.n], u * generic[system.n :])
    here = _along(barriers, system, k, x, u)
    return np.array([
        max(abs(a) + abs(b - a) / _STEP for a, b in zip(one, other, strict=True))
        for one, other in zip(here, there, strict=True)
    ])  # fmt: skip


def _along(
    barriers: Sequence[Barrier], system: PeriodicSystem, k: int, x: NDArray[np.float64], u: NDArray[np.float64]
) -> list[list[float]]:
    """The h of each barrier that its first ψ_m with an effect of u(k) is made of; later inputs are zero."""
    inputs = np.zeros((max((b.relative_degree for b in barriers), default=0), system.m))
    inputs[:1] = u
    states = rollout(system, k, x, inputs)
    return [
        [float(b.h(k + j, states[j])) for j in range(b.relative_degree - b.order, b.relative_degree + 1)]
        for b in barriers
    ]


def _from_matrices(barrier: AffineBarrier, system: PeriodicAffineSystem, phases: Sequence[int]) -> list[int | None]:
    """All phases at once, because every call that adds rows checks them."""
    barrier.check_fits(system.n)
    found = np.zeros(len(phases), dtype=int)
    reach = np.stack([system.B(phase) for phase in phases])
    magnitude = np.abs(reach)
    # By Cayley-Hamilton on the map over a whole period, an input without effect in n periods has none later.
    for r in range(1, system.n * lcm(system.period, barrier.normal_period) + 1):
        normals = np.stack([barrier.normals(phase + r, 1) for phase in phases])
        depends = np.any(np.abs(normals @ reach) > _ROUNDING * (np.abs(normals) @ magnitude), axis=(1, 2))
        found[depends & (found == 0)] = r
        if found.all():
            break
        A = np.stack([system.A(phase + r) for phase in phases])
        reach, magnitude = A @ reach, np.abs(A) @ magnitude
    return [int(r) or None for r in found]


def _differentiated_h(
    barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike, u: ArrayLike, ticks: int
) -> list[Any]:
    """h(k), …, h(k+r), r = `ticks`, as AutoDiffXd in u(k) (floats where it has no effect); later inputs are zero."""
    first = InitializeAutoDiff(vector("the input u", u, system.m).astype(float)).ravel()
    later = np.zeros((ticks - 1, system.m), dtype=object)
    inputs: Array = np.concatenate([first[np.newaxis], later])
    try:
        states = rollout(system, k, x, inputs)
        return [barrier.h(k + j, state) for j, state in enumerate(states)]
    except InputError:
        raise
    except Exception as error:
        _try_with_floats(barrier, system, k, x, u, ticks)
        raise InputError(
            f'barrier "{barrier.name}": the dynamics or h cannot take AutoDiffXd ({error}); '
            "write them with operators and NumPy functions"
        ) from error


def _try_with_floats(barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike, u: ArrayLike, ticks: int) -> None:
    """Raises `InputError`, with the exception that the dynamics or h raise, unless they take floats."""
    what = "the dynamics raise"
    try:
        states = rollout(system, k, x, np.vstack([u, np.zeros((ticks - 1, system.m))]))
        what = "h raises"
        for j, state in enumerate(states):
            barrier.h(k + j, state)
    except InputError:
        raise
    except Exception as error:
        at = shown(np.asarray(x).tolist())
        raise InputError(
            f'barrier "{barrier.name}": {what} {type(error).__name__} ({error}) after tick {k} from the state {at}'
        ) from error


def _value(entry: Any) -> float:
    return float(entry.value() if hasattr(entry, "derivatives") else entry)


def _gradient(entry: Any, size: int) -> NDArray[np.float64]:
    derivatives = entry.derivatives() if hasattr(entry, "derivatives") else np.zeros(0)
    return np.asarray(derivatives, dtype=float) if len(derivatives) else np.zeros(size)
