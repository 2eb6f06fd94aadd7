"""The safe set ∩ C_i(k), i < m, eq. (10): membership, and the inputs with ψ_m ≥ 0 at its states.

From a state of this set, ψ_m ≥ 0 at every tick keeps h ≥ 0 (Theorem 1). `input_interval` gives the inputs that satisfy
ψ_m ≥ 0 of all barriers at one state, `feasible_width` the least width of that interval over the set.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers.affine_input import check_affine_in_input
from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.checks import finite_vector, vector, whole_ticks
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem, check_system, rollout
from pdhocbf_drake.barriers.linear_program import minimum
from pdhocbf_drake.barriers.recursion import linear_rates, psi_along, psi_coefficients
from pdhocbf_drake.barriers.relative_degree import check_degrees, enforced_row, with_samples
from pdhocbf_drake.barriers.requirements import barrier_list
from pdhocbf_drake.barriers.rows import along_normals, check_affine
from pdhocbf_drake.errors import InputError

_TIE = 1e-9  # widths that differ by a smaller share are one; the first is named


def initial_psi(barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike) -> dict[str, float]:
    """The values that must be ≥ 0 at x(k), because no input can change them [unit of h].

    These are ψ_0(k), …, ψ_{m−1}(k); where the relative degree r exceeds m, also ψ_m(k), …, ψ_m(k+r−m−1).
    Their keys are "psi_0", "psi_1", …, and such as "psi_1, 1 tick later," for ψ_m(k+1) and the following ones.

    Raises:
        InputError: the relative degree at tick k is not the declared one, so that an input can change one of them, or
            that a later one belongs to them; or as `rollout`.
    """
    check_system(system)
    k, x = whole_ticks("the tick k", k), vector("the state x", x, system.n)
    check_degrees(barrier, system, [k], with_samples(x))
    return _initial_psi(barrier, system, k, x)


def _initial_psi(barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike) -> dict[str, float]:
    degree = barrier.relative_degree
    # h up to k+r−1 does not depend on the inputs, so any inputs give it.
    states = rollout(system, k, np.asarray(x, dtype=float), np.zeros((degree - 1, system.m)))
    levels = psi_along([float(barrier.h(k + j, state)) for j, state in enumerate(states)], barrier.class_k)
    values = {f"psi_{i}": float(level[0]) for i, level in enumerate(levels) if len(level)}
    for j, value in enumerate(levels[-1][1:], start=1):
        values[f"psi_{barrier.order}, {j} tick{'s' * (j > 1)} later,"] = float(value)
    return values


def in_safe_set(barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike) -> bool:
    """Whether ψ_i(k) ≥ 0 for all i < m: then ψ_m ≥ 0 from k on keeps h ≥ 0 (Theorem 1).

    Raises `InputError` as `initial_psi`.
    """
    return all(value >= 0 for value in initial_psi(barrier, system, k, x).values())


def check_in_safe_set(barrier: Barrier, system: PeriodicSystem, k: int, x: ArrayLike) -> None:
    """Raises `InputError`, with the first negative ψ_i and its value, outside the safe set; or as `initial_psi`."""
    values = initial_psi(barrier, system, k, x)
    for which, value in values.items():
        if not value >= 0:  # NaN too
            unit = f" {barrier.unit}" if barrier.unit not in ("", "1") else ""
            raise InputError(
                f'barrier "{barrier.name}": the state at tick {k} is outside the safe set: '
                f"{which} is {value:.6g}{unit}, but at least 0 is needed"
            )


class WorstCase(NamedTuple):
    """The state of a safe set at which the barriers leave the narrowest interval of inputs.

    Attributes:
        width: width of that interval [unit of u]; negative where the barriers exclude each other, infinite where no
            two of them limit the input from opposite sides.
        state: the state, (n,).
        opponents: names of the two barriers that limit the input there.
    """

    width: float
    state: NDArray[np.float64]
    opponents: tuple[str, str]


def input_interval(system: PeriodicSystem, barriers: Sequence[Barrier], k: int, x: ArrayLike) -> tuple[float, float]:
    """The inputs u(k) with ψ_m ≥ 0 for every barrier at x, as [lower, upper]; empty if lower > upper [unit of u].

    For systems with one input and ψ_m affine in it. A barrier that no input can satisfy at x, or whose ψ_m is not a
    number there, gives (∞, −∞).

    Raises:
        InputError: the system has more than one input; the state has another size, or is not finite; the relative
            degree at tick k is not the declared one; or ψ_m is not affine in the input there.
    """
    _check_one_input(system)
    k, x = whole_ticks("the tick k", k), finite_vector("the state x", x, system.n)
    samples, unlimited = with_samples(x), np.full(1, np.inf)
    lower, upper = -np.inf, np.inf
    for barrier in barrier_list(barriers):
        value, gradient = enforced_row(barrier, system, k, x, np.zeros(1))
        slope = float(gradient[0])
        if np.isnan(value) or np.isnan(slope):
            return np.inf, -np.inf
        check_degrees(barrier, system, [k], samples)
        check_affine_in_input(barrier, system, -unlimited, unlimited, "input_interval", samples, [k])
        if slope > 0:
            lower = max(lower, -value / slope)
        elif slope < 0:
            upper = min(upper, -value / slope)
        elif value < 0:
            return np.inf, -np.inf
    return lower, upper


def feasible_width(system: PeriodicAffineSystem, barriers: Sequence[AffineBarrier], k: int) -> WorstCase:
    """The least width of `input_interval` over the whole common safe set ∩ C_i(k), for linear class-K functions.

    Every limit on u is then affine in x and the safe set a polytope, so the worst case over each pair of opposed
    barriers is a linear program. A width ≥ 0 at every phase certifies that the barriers can be kept together for ever
    (without limits on u): from each state of a safe set, some input leads into the next one.

    Raises:
        InputError: more than one input, nonlinear class-K functions, another relative degree than the declared one at
            tick k, no state in the common safe set, or limits that overflow.
    """
    _check_one_input(system)
    k = whole_ticks("the tick k", k)
    worst = WorstCase(np.inf, np.full(system.n, np.nan), ("", ""))
    members = barrier_list(barriers)
    if not members:
        return worst
    found = [_in_state_and_input(system, barrier, k) for barrier in members]
    inside = np.vstack([rows for rows, _ in found])
    names = [barrier.name for barrier in members]
    # u ≥ limit·[1, x, …] for the lower limits, ≤ for the upper ones
    limits = [-enforced[:-1] / enforced[-1] for _, enforced in found]
    lower = [i for i, (_, enforced) in enumerate(found) if enforced[-1] > 0]
    upper = [i for i, (_, enforced) in enumerate(found) if enforced[-1] < 0]
    for low in lower:
        for high in upper:
            width = limits[high] - limits[low]
            pair = names[low], names[high]
            if not np.isfinite(width @ width + np.sum(inside * inside)):
                raise InputError(f"the limits of barriers {pair[0]} and {pair[1]} are too large for floating point")
            least = minimum(width, inside)
            if least is None:
                raise InputError(
                    f"no state at tick {k} is in the safe sets of all of these barriers: {', '.join(names)}"
                )
            if least.value == -np.inf:
                raise InputError(
                    f"the safe set is unbounded: barriers {pair[0]} and {pair[1]} exclude each other in it"
                )
            if least.value < worst.width - _TIE * abs(worst.width) or worst.width == np.inf:
                worst = WorstCase(least.value, least.point, pair)
    return worst


def _in_state_and_input(
    system: PeriodicAffineSystem, barrier: AffineBarrier, k: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The values of `initial_psi` as rows over [1, x], and ψ_m of `enforced_psi` over [1, x, u]."""
    check_affine(barrier, system)
    check_degrees(barrier, system, [k])
    rates, degree, order = linear_rates(barrier), barrier.relative_degree, barrier.order
    on_state, on_inputs, offset = along_normals(barrier.normals(k, degree + 1), system, k, degree)
    along = np.column_stack([offset, on_state, on_inputs[:, : system.m]])
    h = -barrier.sign * along
    h[:, 0] += barrier.sign * barrier.bound.samples(k, degree + 1)
    rows = [psi_coefficients(rates[:i]) @ h[: i + 1] for i in range(order)]
    later = [psi_coefficients(rates) @ h[j : j + order + 1] for j in range(degree - order + 1)]
    if later[-1][-1] == 0:
        raise InputError(f'barrier "{barrier.name}": the input does not show in psi_{order} at tick {k}')
    return np.array([*rows, *later[:-1]])[:, : 1 + system.n], later[-1]


def _check_one_input(system: PeriodicSystem) -> None:
    if check_system(system).m != 1:
        raise InputError(f"the interval of allowed inputs is for systems with one input, given one with {system.m}")
