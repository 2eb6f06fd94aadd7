"""Robust barriers: what a bounded disturbance, a late measurement and the estimate's error take from a bound.

The state at tick k is x(k + 1) = A_k x + B_k u + c_k + w(k) with |w_i(k)| ≤ w̄_i(k), a periodic bound. Its estimate
x̂(k) errs by |e_i| ≤ ē_i, and is d ticks old when it is used, carried forward by the inputs sent since. With
D = d + r − m (the relative degree r above the order m is one more delay) the prediction of x(κ) from j = κ − D errs by

    Φ(κ, j) e + Σ_{i=j+1}^{κ} Φ(κ, i) w(i − 1),   so that   t_h(κ) = max n_κ·(that)                                (a)

must be left of h; and each tick it changes by the innovation Φ(κ, j) (w(j − 1) + e(j) − A_{j−1} e(j − 1)), which
changes ψ_i by at most

    G_i(κ) = max g_i·(w(j − 1) + e(j) − A_{j−1} e(j − 1)),   g_i = Σ_l c_l^{(i)} n_{κ+l} Φ(κ + l, j),                (b)

with c^{(i)} the `psi_coefficients` of γ_1 … γ_i. By induction, ψ_i(κ) ≥ T_i(κ) for the h that is left, with

    T_0 = 0,   T_{i+1}(κ) = T_i(κ + 1) − (1 − γ_{i+1}) T_i(κ) + G_i(κ + 1),                                         (c)

holds for i < m at the next tick if it holds now and ψ_m ≥ T_m; so h ≥ 0 for the true state for ever.
All of it is periodic. With τ the periodic solution of Π_i (E − (1 − γ_i)) τ = T_m, E the shift by one tick,

    ψ_m ≥ T_m of h − t_h   ⇔   ψ_m ≥ 0 of h − t,   t = t_h + τ:                                                     (d)

a robust barrier is the plain barrier of a bound that is nearer by t. For order 1 without delay and estimate error, t =
n·w̄/γ.
"""

from __future__ import annotations

from math import lcm
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers.barrier import AffineBarrier
from pdhocbf_drake.barriers.bounds import tabulated
from pdhocbf_drake.barriers.checks import finite_array, shown, whole_ticks
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem
from pdhocbf_drake.barriers.recursion import linear_rates, psi_coefficients
from pdhocbf_drake.barriers.rows import check_affine
from pdhocbf_drake.errors import InputError

Array = NDArray[np.float64]


class Uncertainty(NamedTuple):
    """What is not known of a state.

    Attributes:
        disturbance: w̄, half-widths of what tick k may add to x(k + 1), for every k of one period, (P, n) [unit of x].
        estimate: ē, half-widths of the estimate's error, (n,) [unit of x].
        delay: d, the age of an estimate when it is used [ticks].
        innovations: whether w̄ holds all that an estimate differs by from the prediction of it from the one before, so
            that ē adds nothing to it: h of the estimate is kept for the disturbance w̄, and ē is what it must be more.
    """

    disturbance: Array
    estimate: Array
    delay: int = 0
    innovations: bool = False

    @classmethod
    def of(cls, states: int, disturbance: ArrayLike | None, estimate: ArrayLike | None, delay: int) -> Uncertainty:
        """One for a system of that many states; None is zero, (n,) the same at every tick; raises `InputError`."""
        moved, missed = (
            _half_widths("disturbance", disturbance, states, True),
            _half_widths("estimate", estimate, states),
        )
        return cls(np.atleast_2d(moved), missed, whole_ticks("the delay", delay, 0))

    def moved(self, k: int) -> Array:
        """w̄ of tick k, (n,)."""
        return np.asarray(self.disturbance[k % len(self.disturbance)])


class Tightening(NamedTuple):
    """What is left of a barrier, for every tick of one period (P,) [unit of h].

    Attributes:
        h: t_h of (a), which h of a prediction must have for h of the true state to be ≥ 0.
        psi: T_m of (c), which ψ_m of h − t_h must have.
        bound: t of (d), by which the bound comes nearer.
    """

    h: Array
    psi: Array
    bound: Array


def tightening(barrier: AffineBarrier, system: PeriodicAffineSystem, known: Uncertainty) -> Tightening:
    """The tightening (a)–(d) of a barrier with linear class-K functions; raises `InputError` for any other."""
    check_affine(barrier, system)
    barrier.check_fits(system.n)
    rates, period = linear_rates(barrier), lcm(barrier.normal_period, system.period, len(known.disturbance))
    delay = known.delay + barrier.relative_degree - barrier.order
    left = prediction_errors(barrier.normals(0, barrier.normal_period), system, known, delay)
    psi = np.zeros(period)
    for i, rate in enumerate(rates):
        added = np.array([_innovation(barrier, system, known, k, delay, rates[:i]) for k in range(period)])
        psi = np.roll(psi + added, -1) - (1.0 - rate) * psi
    nearer = psi
    for rate in reversed(rates):
        nearer = _periodic(1.0 - rate, nearer)
    return Tightening(left, psi, left + nearer)


def robust_barrier(
    barrier: AffineBarrier,
    system: PeriodicAffineSystem,
    disturbance: ArrayLike | None = None,
    estimate: ArrayLike | None = None,
    delay: int = 0,
) -> AffineBarrier:
    """The barrier whose ψ_m ≥ 0 for the estimated state keeps h ≥ 0 of the given one for the true state, see (d).

    It starts safe where ψ_i(0) ≥ T_i(0) for all i < m, such as where ψ_i(0) ≥ 0 of the returned barrier.

    Args:
        barrier: with linear class-K functions.
        system: x(k + 1) = A_k x + B_k u + c_k + w(k).
        disturbance: w̄ ≥ |w_i| at every tick, (n,), or at tick k of a period, (P, n) [unit of x]; None for none.
        estimate: ē ≥ |x̂_i − x_i| at every tick, (n,) [unit of x]; None for none.
        delay: the age of the estimate, which is carried forward by the inputs sent since, when it is used [ticks].

    Raises:
        InputError: sizes that do not fit, numbers below 0, or a barrier that is not affine with linear class-K
            functions.
    """
    known = Uncertainty.of(system.n, disturbance, estimate, delay)
    return nearer_barrier(barrier, tightening(barrier, system, known).bound)


def nearer_barrier(barrier: AffineBarrier, nearer: Array) -> AffineBarrier:
    """The barrier with a bound that is nearer by t(k), (P,) [unit of h]; the same one where t is 0."""
    if not np.any(nearer):
        return barrier
    count = lcm(len(nearer), barrier.bound.period)
    bound = barrier.bound.samples(0, count) - barrier.sign * np.resize(nearer, count)
    return AffineBarrier(
        barrier.name, barrier.normal, tabulated(bound), barrier.sign, barrier.class_k, barrier.unit,
        barrier.relative_degree,
    )  # fmt: skip


def prediction_errors(normals: Array, system: PeriodicAffineSystem, known: Uncertainty, delay: int) -> Array:
    """t_h of (a) for predictions over `delay` ticks and normals of one period (P', n), at every tick of one, (P,)."""
    errors = []
    for k in range(lcm(len(normals), system.period, len(known.disturbance))):
        row, error = normals[k % len(normals)], 0.0
        if known.innovations:
            error = float(np.abs(row) @ known.estimate)
        for i in range(k, k - delay, -1):
            error += float(np.abs(row) @ known.moved(i - 1))
            row = row @ system.A(i - 1)
        errors.append(error if known.innovations else error + float(np.abs(row) @ known.estimate))
    return np.array(errors)


def _innovation(
    barrier: AffineBarrier,
    system: PeriodicAffineSystem,
    known: Uncertainty,
    k: int,
    delay: int,
    rates: tuple[float, ...],
) -> float:
    """G_i(k) of (b) for γ_1 … γ_i."""
    row = np.zeros(system.n)
    coefficients = psi_coefficients(rates)
    for at in range(len(coefficients) - 1, -delay - 1, -1):
        if at >= 0:
            row = row + coefficients[at] * barrier.normals(k + at, 1)[0]
        if at > -delay:
            row = row @ system.A(k + at - 1)
    before = row @ system.A(k - delay - 1)
    moved = known.moved(k - delay - 1)
    if known.innovations:
        return float(np.abs(row) @ moved)
    return float(np.abs(row) @ (moved + known.estimate) + np.abs(before) @ known.estimate)


def _periodic(keep: float, added: Array) -> Array:
    """The periodic y with y(k + 1) = keep y(k) + added(k), 0 ≤ keep < 1."""
    value, period = 0.0, len(added)
    for part in added:
        value = keep * value + part
    values = [value / (1.0 - keep**period)]
    for part in added[:-1]:
        values.append(keep * values[-1] + part)
    return np.array(values)


def _half_widths(what: str, given: ArrayLike | None, states: int, by_tick: bool = False) -> Array:
    if given is None:
        return np.zeros(states)
    sides = finite_array(f"the {what}", given)
    fits = sides.shape == (states,) or (by_tick and sides.ndim == 2 and len(sides) and sides.shape[1] == states)
    if not fits or np.any(sides < 0.0):
        ticks = ", or as many for each tick of a period" if by_tick else ""
        raise InputError(f"the {what} is {states} half-widths ≥ 0, one for each state{ticks}, given {shown(given)}")
    return sides
