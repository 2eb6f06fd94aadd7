"""ψ_m(k+i) ≥ 0 over a horizon as linear rows, for affine barriers on affine periodic dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.solvers import Binding, LinearConstraint, MathematicalProgram
from pydrake.symbolic import Variable

from pdhocbf_drake.barriers.barrier import AffineBarrier, Barrier
from pdhocbf_drake.barriers.checks import (
    decision_variables,
    finite_number,
    numbers_or_variables,
    shown,
    vector,
    whole_ticks,
)
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem, PeriodicSystem
from pdhocbf_drake.barriers.recursion import linear_rates, psi_coefficients
from pdhocbf_drake.barriers.relative_degree import check_relative_degree
from pdhocbf_drake.errors import InputError

AlongNormals = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


class Rows(NamedTuple):
    """ψ_m(k+i) = state[i]·x(k) + inputs[i]·U + bounds[i]·[V̄(k), …, V̄(k+H)] + constant[i],  i = 0, …, H−m.

    U stacks u(k), …, u(k+H−1). The samples of the bound are an argument, since a bound may be computed at run time.

    Attributes:
        state: (H−m+1, n).
        inputs: (H−m+1, H·n_u).
        bounds: (H−m+1, H+1).
        constant: (H−m+1,), from the c_k of the dynamics [unit of h].
    """

    state: NDArray[np.float64]
    inputs: NDArray[np.float64]
    bounds: NDArray[np.float64]
    constant: NDArray[np.float64]

    def values(self, x: ArrayLike, inputs: ArrayLike, bound_samples: ArrayLike) -> NDArray[np.float64]:
        """ψ_m(k), …, ψ_m(k+H−m) [unit of h]."""
        vectors = (np.asarray(part, dtype=float).ravel() for part in (x, inputs, bound_samples))
        return self.constant + sum(M @ v for M, v in zip((self.state, self.inputs, self.bounds), vectors, strict=True))

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """Whether a row depends on some input of the horizon; no controller can change the others."""
        return np.asarray(np.any(self.inputs != 0, axis=1))


def affine_rows(
    barrier: AffineBarrier,
    system: PeriodicAffineSystem,
    k: int,
    horizon: int,
    along: AlongNormals | None = None,
    restarts: Sequence[int] = (),
) -> Rows:
    """The rows of ψ_m(k), …, ψ_m(k+H−m); they depend on k only through its phase.

    Where h jumps because it is seen anew, the recursion starts again: by Theorem 1 ψ_i(k+t) ≥ 0 for i < m, and ψ_m ≥ 0
    from there on, keep h ≥ 0. They take the place of the rows that would compare h before and after the jump: each row
    is the ψ of the highest order up to m that ends at its last tick and begins no earlier than the jump.

    Args:
        along: result of `along_normals` for these normals, system, k and horizon, if the caller has it; not checked.
        restarts: the t at which h is seen anew, from 1 to H, ascending.

    Raises:
        InputError: the horizon is shorter than m, the class-K functions are not linear, the barrier's normal has
            another size than the state, barrier or system are not affine, or the rows overflow.
    """
    check_affine(barrier, system)
    where, order = f'barrier "{barrier.name}"', barrier.order
    k, horizon = whole_ticks(f"{where}: the tick k", k), whole_ticks(f"{where}: the horizon", horizon)
    if horizon < order:
        raise InputError(f"{where}: psi_{order} needs a horizon of {order} ticks, given {horizon}")
    barrier.check_fits(system.n)
    on_state, on_inputs, offset = along or along_normals(barrier.normals(k, horizon + 1), system, k, horizon)
    # Row i of `shifts` holds the coefficients of h(k+i), …, h(k+i+m).
    shifts, rates = np.zeros((horizon - order + 1, horizon + 1)), linear_rates(barrier)
    for i, coefficient in enumerate(psi_coefficients(rates)):
        np.fill_diagonal(shifts[:, i:], barrier.sign * coefficient)
    for start in restarts:
        for last in range(max(start, order), min(start + order, horizon + 1)):
            row = shifts[last - order]
            row[:] = 0.0
            row[start : last + 1] = barrier.sign * psi_coefficients(rates[: last - start])
    rows = Rows(-shifts @ on_state, -shifts @ on_inputs, shifts, -shifts @ offset)
    if not all(np.all(np.isfinite(part)) for part in rows):  # Drake would end the process
        raise InputError(f"{where}: the rows over {horizon} ticks are too large for floating point")
    return rows


def along_normals(normals: NDArray[np.float64], system: PeriodicAffineSystem, k: int, horizon: int) -> AlongNormals:
    """n_{k+j}·x(k+j) = on_state[j]·x(k) + on_inputs[j]·U + offset[j], j = 0, …, H: (H+1, n), (H+1, H·n_u), (H+1,).

    Computed backwards from the end of the horizon: after step i, on_state[j] multiplies x(k+i) in n_{k+j}·x(k+j).

    Args:
        normals: n_k, …, n_{k+H}, shape (H+1, n).
    """
    on_state = normals.copy()
    on_inputs, offset = np.zeros((horizon + 1, horizon * system.m)), np.zeros(horizon + 1)
    for i in reversed(range(horizon)):
        later = on_state[i + 1 :]
        on_inputs[i + 1 :, i * system.m : (i + 1) * system.m] = later @ system.B(k + i)
        offset[i + 1 :] += later @ system.c(k + i)
        on_state[i + 1 :] = later @ system.A(k + i)
    return on_state, on_inputs, offset


def check_affine(barrier: Barrier, system: PeriodicSystem) -> None:
    """Raises `InputError` unless the barrier is an `AffineBarrier` and the system a `PeriodicAffineSystem`."""
    if not (isinstance(barrier, AffineBarrier) and isinstance(system, PeriodicAffineSystem)):
        raise InputError(
            f"linear rows need an AffineBarrier on a PeriodicAffineSystem, given {shown(barrier)} on "
            f"a {type(system).__name__}; add_nonlinear_barrier_rows takes any"
        )


def add_barrier_rows(
    prog: MathematicalProgram,
    barrier: AffineBarrier,
    system: PeriodicAffineSystem,
    k: int,
    x0: ArrayLike,
    inputs: NDArray[Any],
    slack: Variable | NDArray[Any] | None = None,
    tightening: float = 0.0,
) -> Binding[LinearConstraint]:
    """Adds ψ_m(k+i) + slack ≥ tightening over the horizon, as one constraint named "barrier NAME".

    Rows that no input of the horizon can change (the first ones, where the relative degree exceeds m) are left out,
    since they could make the program infeasible.

    Args:
        x0: x(k), (n,): finite numbers, or decision variables.
        inputs: decision variables (H, n_u).
        slack: one decision variable for all rows, or one for each of the H−m+1 rows, constrained to be ≥ 0; its
            cost is the caller's. None makes the barrier hard.
        tightening: d̄ ≥ 0 [unit of h]; ψ_m ≥ d̄ keeps h ≥ 0 although the last h of each ψ_m errs by up to d̄.

    Raises:
        InputError: as `affine_rows`; a declared relative degree that is not the computed one; shapes that do not fit; a
            number that is not finite; or no row that depends on an input.
    """
    where = f'barrier "{barrier.name}"'
    inputs = decision_variables(f"{where}: the inputs", inputs)
    start = vector(f"{where}: x0", numbers_or_variables(f"{where}: x0", x0), system.n)
    tightening = finite_number(f"{where}: the tightening", tightening, 0.0)
    if inputs.ndim != 2 or inputs.shape[1] != system.m:
        raise InputError(f"{where}: the inputs must have shape (H, {system.m}), given {inputs.shape}")
    horizon = len(inputs)
    rows = affine_rows(barrier, system, k, horizon)
    check_relative_degree(barrier, system)
    # The relative degree says on which inputs a row depends; the other coefficients are zero but for rounding.
    depends = np.arange(len(rows.constant))[:, None] - np.arange(horizon) >= barrier.relative_degree - barrier.order
    on_inputs = np.where(np.repeat(depends, system.m, axis=1), rows.inputs, 0.0)
    chosen = depends[:, 0]
    if not np.any(chosen):
        raise InputError(f"{where}: no input within the horizon of {horizon} ticks shows in it")
    lower = tightening - rows.constant - rows.bounds @ barrier.bound.samples(k, horizon + 1)
    matrix, variables = [on_inputs], [inputs.ravel()]
    if start.dtype == object:
        matrix.append(rows.state)
        variables.append(start)
    else:
        lower -= rows.state @ start
    if not np.all(np.isfinite(lower)):
        raise InputError(f"{where}: the rows are too large for floating point at this x0")
    if slack is not None:
        slacks = slack_variables(prog, barrier.name, slack, len(chosen))
        matrix.append(np.ones((len(chosen), 1)) if len(slacks) == 1 else np.eye(len(chosen)))
        variables.append(slacks)
    binding = prog.AddLinearConstraint(
        np.hstack(matrix)[chosen], lower[chosen], np.full(int(chosen.sum()), np.inf), np.concatenate(variables)
    )
    binding.evaluator().set_description(f"barrier {barrier.name}")
    return binding


def slack_variables(prog: MathematicalProgram, name: str, slack: Any, count: int) -> NDArray[Any]:
    """The slacks of barrier `name` as a vector of 1 or `count` decision variables, constrained to be ≥ 0.

    Raises `InputError` for another number of them, or other things than decision variables.
    """
    slacks = np.atleast_1d(decision_variables(f'barrier "{name}": slacks', slack))
    if slacks.shape not in ((1,), (count,)):
        raise InputError(f'barrier "{name}": 1 slack, or one per row ({count}), is allowed, given {slacks.size}')
    positive = prog.AddBoundingBoxConstraint(0.0, np.inf, slacks)
    positive.evaluator().set_description(f"barrier {name}: slack")
    return slacks
