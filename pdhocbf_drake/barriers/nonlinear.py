"""ψ_m(k+i) ≥ 0 over a horizon for any barrier, class-K function and dynamics: nonlinear constraints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.autodiffutils import InitializeAutoDiff
from pydrake.solvers import Binding, Constraint, MathematicalProgram
from pydrake.symbolic import Variable

from pdhocbf_drake.barriers.barrier import Barrier
from pdhocbf_drake.barriers.checks import decision_variables, finite_number, numbers_or_variables, whole_ticks
from pdhocbf_drake.barriers.dynamics import Array, PeriodicSystem, check_system, next_state, rollout
from pdhocbf_drake.barriers.recursion import psi_from_h
from pdhocbf_drake.barriers.relative_degree import check_degrees, phases_of
from pdhocbf_drake.barriers.rows import slack_variables
from pdhocbf_drake.errors import InputError


def add_nonlinear_barrier_rows(
    prog: MathematicalProgram,
    barrier: Barrier,
    system: PeriodicSystem,
    k: int,
    states: ArrayLike,
    inputs: NDArray[Any],
    slack: Variable | NDArray[Any] | None = None,
    tightening: float = 0.0,
    samples: ArrayLike | None = None,
) -> list[Binding[Constraint]]:
    """Adds ψ_m(k+i) + slack ≥ tightening for i = r−m, …, H−m, r the relative degree; solve with SNOPT or IPOPT.

    r is the declared one, which is compared with the computed one at each tick of the horizon: about 1 ms a tick.

    Args:
        states: x(k), (n,), finite numbers or decision variables: shooting, one vector constraint in the inputs; or
            decision variables (H+1, n): one constraint a tick in x(k+i), …, x(k+i+m), to which `add_dynamics` adds
            the dynamics as constraints of their own.
        inputs: decision variables (H, n_u).
        slack: as in `add_barrier_rows`, for rows i = 0, …, H−m.
        tightening: as in `add_barrier_rows` [unit of h].
        samples: (S, n), states at which h and the dynamics are defined, where they are checked.

    Raises:
        InputError: as `check_relative_degree`; shapes that do not fit, a number that is not finite, or a horizon
            shorter than the relative degree; or a class-K function that can't take AutoDiffXd.
    """
    check_system(system)
    where = f'barrier "{barrier.name}"'
    k, tightening = whole_ticks(f"{where}: the tick k", k), finite_number(f"{where}: the tightening", tightening, 0.0)
    inputs = decision_variables(f"{where}: the inputs", inputs)
    points = numbers_or_variables(f"{where}: the states", states)
    horizon = len(inputs)
    rows = range(barrier.relative_degree - barrier.order, horizon - barrier.order + 1)
    if inputs.shape != (horizon, system.m):
        raise InputError(f"{where}: the inputs must have shape (H, {system.m}), given {inputs.shape}")
    if points.shape not in ((system.n,), (horizon + 1, system.n)):
        allowed = f"({system.n},) or ({horizon + 1}, {system.n})"
        raise InputError(f"{where}: the states must have shape {allowed}, given {points.shape}")
    if len(rows) == 0:
        raise InputError(f"{where}: a horizon of {barrier.relative_degree} ticks is needed, given {horizon}")
    period = len(phases_of(barrier, system))
    acting = sorted({(k + j) % period for j in range(horizon - barrier.relative_degree + 1)})
    check_degrees(barrier, system, acting, samples)
    count = horizon - barrier.order + 1
    slacks = np.zeros(0, dtype=object) if slack is None else slack_variables(prog, barrier.name, slack, count)
    if points.ndim == 2:
        return [
            _add(prog, barrier, lambda values: values.reshape(-1, system.n), k + i,
                 points[i : i + barrier.order + 1].ravel(), slacks if len(slacks) < 2 else slacks[i : i + 1],
                 1, tightening, f"barrier {barrier.name}, row {i}")
            for i in rows
        ]  # fmt: skip
    free = points.dtype == object

    def shooting(values: Array) -> Array:
        x, given = (values[: system.n], values[system.n :]) if free else (points, values)
        return rollout(system, k, x, given)

    variables = np.concatenate([points, inputs.ravel()]) if free else inputs.ravel()
    slacks = slacks if len(slacks) < 2 else slacks[rows.start :]
    return [_add(prog, barrier, shooting, k, variables, slacks, len(rows), tightening, f"barrier {barrier.name}")]


def add_dynamics(
    prog: MathematicalProgram, system: PeriodicSystem, k: int, states: NDArray[Any], inputs: NDArray[Any]
) -> list[Binding[Constraint]]:
    """Adds x(k+i+1) = f(k+i, x(k+i), u(k+i)) for decision variables `states` (H+1, n) and `inputs` (H, n_u).

    Raises `InputError` for other shapes, or other things than decision variables.
    """
    check_system(system)
    k = whole_ticks("the tick k", k)
    states, inputs = decision_variables("the states", states), decision_variables("the inputs", inputs)
    if inputs.ndim != 2 or inputs.shape[1] != system.m or states.shape != (len(inputs) + 1, system.n):
        raise InputError(
            f"dynamics over H ticks need states (H+1, {system.n}) and inputs (H, {system.m}), given {states.shape} and "
            f"{inputs.shape}"
        )
    bindings = []
    for i in range(len(inputs)):

        def defect(variables: Array, tick: int = k + i) -> Array:
            x, u, after = np.split(variables, [system.n, system.n + system.m])
            return after - next_state(system, tick, x, u)

        variables = np.concatenate([states[i], inputs[i], states[i + 1]])
        zero = np.zeros(system.n)
        bindings.append(prog.AddConstraint(defect, lb=zero, ub=zero, vars=variables, description=f"dynamics, row {i}"))
    return bindings


def _add(
    prog: MathematicalProgram, barrier: Barrier, states: Callable[[Array], Array], first: int, variables: Array,
    slacks: Array, count: int, tightening: float, description: str,
) -> Binding[Constraint]:  # fmt: skip
    """Adds the last `count` rows ψ_m + slack ≥ tightening along states(variables), which begin at tick `first`.

    `slacks` has one variable for each row, or one for all, or none.
    """

    def with_slack(values: Array) -> Array:
        h = [barrier.h(first + j, x) for j, x in enumerate(states(values[: len(variables)]))]
        starts = range(len(h) - barrier.order - count, len(h) - barrier.order)
        psi = np.array([psi_from_h(h[i : i + barrier.order + 1], barrier.class_k)[-1] for i in starts])
        return psi + values[len(variables) :] if len(slacks) else psi

    both = np.concatenate([variables, slacks])
    try:
        with_slack(InitializeAutoDiff(np.random.default_rng(0).standard_normal(len(both))).ravel())
    except (TypeError, AttributeError) as error:  # Drake would raise it from within the solver
        raise InputError(
            f'barrier "{barrier.name}": a class-K function, h or the dynamics cannot take AutoDiffXd ({error}); '
            "write them with operators and NumPy functions"
        ) from error
    lower, upper = np.full(count, tightening), np.full(count, np.inf)
    return prog.AddConstraint(with_slack, lb=lower, ub=upper, vars=both, description=description)
