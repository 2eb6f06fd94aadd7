"""ψ_m(k+i) ≥ 0 over a horizon for any barrier, class-K function and dynamics: nonlinear constraints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.solvers import Binding, Constraint, MathematicalProgram
from pydrake.symbolic import Variable

from pdhocbf_drake.barriers.barrier import Barrier
from pdhocbf_drake.barriers.checks import decision_variables, finite_number, numbers_or_variables, whole_ticks
from pdhocbf_drake.barriers.dynamics import Array, PeriodicSystem, rollout
from pdhocbf_drake.barriers.recursion import psi_from_h
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
) -> list[Binding[Constraint]]:
    """Adds ψ_m(k+i) + slack ≥ tightening for i = r−m, …, H−m, r the relative degree; solve with SNOPT or IPOPT.

    r is the declared one: computing it for general dynamics is expensive, so call `check_relative_degree` once before.

    Args:
        states: x(k), (n,), finite numbers or decision variables: shooting, one vector constraint in the inputs; or
            decision variables (H+1, n): one constraint a tick in x(k+i), …, x(k+i+m), to which `add_dynamics` adds
            the dynamics as constraints of their own.
        inputs: decision variables (H, n_u).
        slack: one decision variable for all rows, or one for each of the H−m+1 rows i = 0, …, H−m; kept ≥ 0
            here, paid for by the caller's cost. None makes the barrier hard.
        tightening: as in `add_barrier_rows` [unit of h].

    Raises:
        InputError: shapes that do not fit, a number that is not finite, or a horizon shorter than the relative degree.
    """
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
    slacks: list[Any] = []
    if slack is not None:
        count = horizon - barrier.order + 1
        slacks = list(np.broadcast_to(slack_variables(prog, barrier.name, slack, count), count))
    if points.ndim == 2:
        return [
            _add(prog, barrier, _along_states(barrier, system.n, k, i), [points[i : i + barrier.order + 1]],
                 [slacks[i]] if slack is not None else [], 1, tightening, f"barrier {barrier.name}, row {i}")
            for i in rows
        ]  # fmt: skip
    free = points.dtype == object
    return [
        _add(prog, barrier, _shooting(barrier, system, k, None if free else points, rows),
             [points, inputs] if free else [inputs], [slacks[i] for i in rows] if slack is not None else [],
             len(rows), tightening, f"barrier {barrier.name}")
    ]  # fmt: skip


def add_dynamics(
    prog: MathematicalProgram, system: PeriodicSystem, k: int, states: NDArray[Any], inputs: NDArray[Any]
) -> list[Binding[Constraint]]:
    """Adds x(k+i+1) = f(k+i, x(k+i), u(k+i)) for decision variables `states` (H+1, n) and `inputs` (H, n_u).

    Raises:
        InputError: other shapes, or no decision variables.
    """
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
            return after - np.asarray(system.step(tick, x, u))

        variables = np.concatenate([states[i], inputs[i], states[i + 1]])
        zero = np.zeros(system.n)
        bindings.append(prog.AddConstraint(defect, lb=zero, ub=zero, vars=variables, description=f"dynamics, row {i}"))
    return bindings


def _along_states(barrier: Barrier, n: int, k: int, i: int) -> Callable[[Array], list[Any]]:
    def last_psi(variables: Array) -> list[Any]:
        h = [barrier.h(k + i + j, x) for j, x in enumerate(variables.reshape(-1, n))]
        return [psi_from_h(h, barrier.class_k)[-1]]

    return last_psi


def _shooting(
    barrier: Barrier, system: PeriodicSystem, k: int, start: Array | None, rows: range
) -> Callable[[Array], list[Any]]:
    def last_psis(variables: Array) -> list[Any]:
        x, inputs = (variables[: system.n], variables[system.n :]) if start is None else (start, variables)
        h = [barrier.h(k + j, state) for j, state in enumerate(rollout(system, k, x, inputs))]
        return [psi_from_h(h[i : i + barrier.order + 1], barrier.class_k)[-1] for i in rows]

    return last_psis


def _add(
    prog: MathematicalProgram, barrier: Barrier, function: Callable[[Array], list[Any]], blocks: list[Array],
    slacks: list[Any], count: int, tightening: float, description: str,
) -> Binding[Constraint]:  # fmt: skip
    """`slacks`: empty, or one variable per row, in which one variable may occur several times."""
    names = list({slack.get_id(): slack for slack in slacks}.values())
    column = [[name.get_id() for name in names].index(slack.get_id()) for slack in slacks]
    size = sum(block.size for block in blocks)

    def with_slack(variables: Array) -> Array:
        values = np.array(function(variables[:size]))
        return values + variables[size:][column] if column else values

    variables = np.concatenate([*(block.ravel() for block in blocks), np.array(names, dtype=object)])
    lower, upper = np.full(count, tightening), np.full(count, np.inf)
    return prog.AddConstraint(with_slack, lb=lower, ub=upper, vars=variables, description=description)
