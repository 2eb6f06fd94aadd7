"""The safe set ∩ C_i(k), i < m, eq. (10): membership, and the inputs with ψ_m ≥ 0 at its states.

From a state of this set, ψ_m ≥ 0 at every tick keeps h ≥ 0 (Theorem 1). `input_interval` gives the inputs that satisfy
ψ_m ≥ 0 of all barriers at one state, `feasible_width` the least width of that interval over the set.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.solvers import ClpSolver, MathematicalProgram

from pdhocbf_drake.barriers.affine_input import check_affine_in_input
from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.checks import finite_vector, vector, whole_ticks
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem, check_system, rollout
from pdhocbf_drake.barriers.recursion import linear_rates, psi_along
from pdhocbf_drake.barriers.relative_degree import check_degrees, enforced_row, with_samples
from pdhocbf_drake.barriers.requirements import barrier_list
from pdhocbf_drake.barriers.rows import check_affine
from pdhocbf_drake.errors import InputError


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
    if not barrier_list(barriers):
        return worst
    for barrier in barriers:
        check_affine(barrier, system)
        check_degrees(barrier, system, [k])
        linear_rates(barrier)
    inside_offset, inside_slope = _affine_in_state(system, barriers, k)
    # (name, offset, slope): u ≥ offset + slope·x for the lower limits, ≤ for the upper ones
    lower: list[tuple[str, float, NDArray[np.float64]]] = []
    upper: list[tuple[str, float, NDArray[np.float64]]] = []
    for barrier in barriers:
        offset, on_state, on_input = _enforced_row(system, barrier, k)
        (lower if on_input > 0 else upper).append((barrier.name, -offset / on_input, -on_state / on_input))
    for low_name, low, low_slope in lower:
        for high_name, high, high_slope in upper:
            limits = np.array([high - low, *(high_slope - low_slope)])
            if not all(np.all(np.isfinite(part)) for part in (limits, inside_offset, inside_slope)):
                # Drake would end the process
                raise InputError(f"the limits of barriers {low_name} and {high_name} are too large for floating point")
            prog = MathematicalProgram()
            x = prog.NewContinuousVariables(system.n, "x")
            prog.AddLinearConstraint(inside_slope, -inside_offset, np.full(len(inside_offset), np.inf), x)
            prog.AddLinearCost(high_slope - low_slope, high - low, x)
            result = ClpSolver().Solve(prog)
            if result.get_solution_result().name == "kDualInfeasible":
                raise InputError(
                    f"the safe set is unbounded: barriers {low_name} and {high_name} exclude each other in it"
                )
            if not result.is_success():
                names = ", ".join(barrier.name for barrier in barriers)
                raise InputError(f"no state at tick {k} is in the safe sets of all of these barriers: {names}")
            if result.get_optimal_cost() < worst.width:
                worst = WorstCase(result.get_optimal_cost(), result.GetSolution(x), (low_name, high_name))
    return worst


def _affine_in_state(
    system: PeriodicAffineSystem, barriers: Sequence[AffineBarrier], k: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Offsets and slopes of all ψ_i(k), i < m, as affine functions of x, from their values at 0 and at unit vectors."""

    def values(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([list(_initial_psi(barrier, system, k, x).values()) for barrier in barriers])

    offset = values(np.zeros(system.n))
    return offset, np.stack([values(unit) - offset for unit in np.eye(system.n)], axis=1)


def _enforced_row(
    system: PeriodicAffineSystem, barrier: AffineBarrier, k: int
) -> tuple[float, NDArray[np.float64], float]:
    """(a, b, c) with ψ_m(k) = a + b·x + c·u."""
    offset, gradient = enforced_row(barrier, system, k, np.zeros(system.n), np.zeros(1))
    on_state = [enforced_row(barrier, system, k, unit, np.zeros(1))[0] - offset for unit in np.eye(system.n)]
    return offset, np.array(on_state), float(gradient[0])


def _check_one_input(system: PeriodicSystem) -> None:
    if check_system(system).m != 1:
        raise InputError(f"the interval of allowed inputs is for systems with one input, given one with {system.m}")
