"""Joint feasibility: barriers that share one input must leave some of it. This is checked, not assumed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.solvers import ClpSolver, MathematicalProgram

from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.checks import finite_vector
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem
from pdhocbf_drake.barriers.membership import initial_psi
from pdhocbf_drake.barriers.recursion import linear_rates
from pdhocbf_drake.barriers.rows import check_affine
from pdhocbf_drake.barriers.sensitivity import enforced_psi
from pdhocbf_drake.errors import InputError


class WorstCase(NamedTuple):
    """The tightest case over a safe set.

    Attributes:
        width: least width of the interval of inputs that all barriers allow [unit of u]; negative where
            they exclude each other, infinite where no two oppose each other.
        state: a state of the safe set with that width, (n,).
        opponents: names of the two barriers that meet there.
    """

    width: float
    state: NDArray[np.float64]
    opponents: tuple[str, str]


def input_interval(system: PeriodicSystem, barriers: Sequence[Barrier], k: int, x: ArrayLike) -> tuple[float, float]:
    """The inputs u(k) with ψ_m ≥ 0 for every barrier at x, as [lower, upper]; empty if lower > upper [unit of u].

    For systems with one input and ψ_m affine in it. A barrier that no input can satisfy at x, or whose ψ_m is not a
    number there, gives (∞, −∞).

    Raises:
        InputError: the system has more than one input; or the state has another size, or is not finite.
    """
    _check_one_input(system)
    x = finite_vector("the state x", x, system.n)
    lower, upper = -np.inf, np.inf
    for barrier in barriers:
        value, gradient = enforced_psi(barrier, system, k, x, np.zeros(1))
        slope = float(gradient[0])
        if np.isnan(value) or np.isnan(slope):
            return np.inf, -np.inf
        if slope > 0:
            lower = max(lower, -value / slope)
        elif slope < 0:
            upper = min(upper, -value / slope)
        elif value < 0:
            return np.inf, -np.inf
    return lower, upper


def feasible_width(system: PeriodicAffineSystem, barriers: Sequence[AffineBarrier], k: int) -> WorstCase:
    """The least width of `input_interval` over the whole common safe set ∩ C_i(k), linear class-K functions.

    Every limit on u is then affine in x and the safe set a polytope, so the worst case over each pair of opposed
    barriers is a linear program. A width ≥ 0 at every phase certifies that the barriers can be kept together for
    ever (without limits on u): from the safe set, some input leads into the next one.

    Raises:
        InputError: more than one input, nonlinear class-K functions, no state in the common safe set, or limits that
            overflow.
    """
    _check_one_input(system)
    if not barriers:
        return WorstCase(np.inf, np.full(system.n, np.nan), ("", ""))
    for barrier in barriers:
        check_affine(barrier, system)
        linear_rates(barrier)
    inside_offset, inside_slope = _affine_in_state(system, barriers, k)
    # (name, offset, slope): u ≥ offset + slope·x for the lower limits, ≤ for the upper ones
    lower: list[tuple[str, float, NDArray[np.float64]]] = []
    upper: list[tuple[str, float, NDArray[np.float64]]] = []
    for barrier in barriers:
        offset, on_state, on_input = _enforced_row(system, barrier, k)
        (lower if on_input > 0 else upper).append((barrier.name, -offset / on_input, -on_state / on_input))
    worst = WorstCase(np.inf, np.full(system.n, np.nan), ("", ""))
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
    """Offsets and slopes of all ψ_i(k), i < m, as affine functions of x: read off at 0 and the unit vectors."""

    def values(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([list(initial_psi(barrier, system, k, x).values()) for barrier in barriers])

    offset = values(np.zeros(system.n))
    return offset, np.stack([values(unit) - offset for unit in np.eye(system.n)], axis=1)


def _enforced_row(
    system: PeriodicAffineSystem, barrier: AffineBarrier, k: int
) -> tuple[float, NDArray[np.float64], float]:
    offset, gradient = enforced_psi(barrier, system, k, np.zeros(system.n), np.zeros(1))
    if gradient[0] == 0:
        raise InputError(f'barrier "{barrier.name}": the input does not show in psi_{barrier.order} at tick {k}')
    on_state = [enforced_psi(barrier, system, k, unit, np.zeros(1))[0] - offset for unit in np.eye(system.n)]
    return offset, np.array(on_state), float(gradient[0])


def _check_one_input(system: PeriodicSystem) -> None:
    if system.m != 1:
        raise InputError(f"the interval of allowed inputs is for systems with one input, given one with {system.m}")
