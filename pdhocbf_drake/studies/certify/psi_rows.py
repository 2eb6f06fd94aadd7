"""The ψ rows of a barrier on the CoM velocity, written as limits on state and input for `invariant_set`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier, PeriodicAffineSystem
from pdhocbf_drake.barriers.recursion import linear_rates
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.polytope import Array, Polytope
from pdhocbf_drake.studies.shared.stepping_template import FASTEST, SteppingTemplate

Problem = tuple[PeriodicAffineSystem, list[Polytope | None], list[Polytope]]


def psi_disturbance(template: SteppingTemplate, barrier: AffineBarrier, points: Sequence[Array]) -> list[Array]:
    """What w(k) on [c, v, s](k+1) is on the state of `psi_system`, at every phase, each (w, n + 1).

    With h = s(V̄ − n v) and y(k+1) = ψ_1(k+1), w(k) adds [w_c, w_v, −s n (γ_1 w_v + δ eta_{k+1} w_c)] to [c, v, y].

    Args:
        points: whose hull is W_k, (w, n), for every phase.
    """
    slope, scale = linear_rates(barrier)[0], float(barrier.sign * barrier.normal[1])
    following = np.roll(template.eta, -1) * template.tick
    on_psi = [-scale * (slope * w[:, 1] + rise * w[:, 0]) for w, rise in zip(points, following, strict=True)]
    return [np.insert(w, 2, added, axis=1) for w, added in zip(points, on_psi, strict=True)]


def psi_system(template: SteppingTemplate, barrier: AffineBarrier) -> Problem | None:
    """The template with y(k) = ψ_1(k) in place of the ZMP, so that the rows are plain limits on state and input.

    With h(k+1) = y + (1 − γ_1) h(k) the velocity follows from y alone, v(k+1) = V̄(k+1) ∓ h(k+1), and the ZMP box is
    a limit on the state [c, v, y, s]. ψ_1 ≥ 0 is y ≥ 0; for order 2, y(k+1) = (1 − γ_2) y(k) + ψ_2(k) with the input
    ψ_2 ≥ 0, as the controller's rows demand; for order 1, y(k+1) is free. So the set holds the states from which, and
    the ZMPs with which, the rows can be kept for ever: it shows the cost of γ.

    Returns:
        Dynamics, state limits and input limits for `invariant_set`; None for a barrier whose normal is not a constant
        multiple of the velocity's, whose order is above 2, or whose class-K functions are not linear.
    """
    try:
        rates = linear_rates(barrier)
    except InputError:
        return None
    if len(rates) > 2 or barrier.normal.ndim > 1 or barrier.normal[0] != 0.0:
        return None
    keep, following = 1.0 - rates[0], (1.0 - rates[1] if len(rates) == 2 else 0.0)
    period, n, sign, scale = template.period, template.system.n, float(barrier.sign), float(barrier.normal[1])
    A, c = np.zeros((period, n + 1, n + 1)), np.zeros((period, n + 1))
    B = np.zeros((period, n + 1, template.system.m))
    states: list[Polytope | None] = []
    inputs = []
    largest = _largest_psi(template, barrier, rates[0])
    old = [0, 1, 3][:n]  # indices of c, v (and s) in the new state
    for k in range(period):
        here, there = barrier.bound(k) / scale, barrier.bound(k + 1) / scale
        free, on_input, offset = template.system.A(k), template.system.B(k), template.system.c(k)
        A[k][np.ix_(old, old)] = free
        c[k, old] = offset
        B[k, old, 1:] = on_input[:, 1:]
        # v⁺ = V̄⁺ − (1 − γ_1)(V̄ − v) − s y/scale
        A[k, 1] = 0.0
        A[k, 1, 1], A[k, 1, 2], c[k, 1] = keep, -sign / scale, there - keep * here
        A[k, 2, 2], B[k, 2, 0] = following, 1.0
        # This takes the ZMP d = (v⁺ − A_k[v]·x − c_k[v])/B_k[v, d], which must lie within ± half.
        zmp = A[k, 1].copy()
        zmp[old] -= free[1]
        zmp /= on_input[1, 0]
        shift = (c[k, 1] - offset[1]) / on_input[1, 0]
        h = np.zeros(n + 1)
        h[1] = sign * scale
        positive = np.eye(n + 1)[2]
        limits = template.states[k]
        rows = np.zeros((len(limits.A), n + 1))
        rows[:, old] = limits.A
        new = [sign * barrier.bound(k), 0.0, largest, template.half - shift, template.half + shift]
        states.append(
            Polytope.from_rows(np.vstack([rows, h, -positive, positive, zmp, -zmp]), np.concatenate([limits.b, new]))
        )
        low, high = template.inputs[k].vertices.min(axis=0), template.inputs[k].vertices.max(axis=0)
        inputs.append(Polytope.box([0.0, *low[1:]], [largest, *high[1:]]))
    return PeriodicAffineSystem(A, B, c), states, inputs


def zmp_of_psi(template: SteppingTemplate, barrier: AffineBarrier, phase: int, state: Array) -> float:
    """The ZMP, from the stance foot, of a state [c, v, ψ_1, …] of `psi_system` [m]."""
    com, velocity, psi = state[:3]
    normal = float(barrier.normal[1])
    h = barrier.sign * (barrier.bound(phase) - normal * velocity)
    after = psi + (1.0 - linear_rates(barrier)[0]) * h
    following = (barrier.bound(phase + 1) - barrier.sign * after) / normal
    return float(com - (following - velocity) / (template.tick * template.eta[phase % template.period]))


def _largest_psi(template: SteppingTemplate, barrier: AffineBarrier, gamma: float) -> float:
    """An upper bound of ψ_1 = γ h + V̄(k+1) − V̄(k) ∓ (v(k+1) − v(k)) within the limits [unit of h]."""
    bound, scale = np.array([barrier.bound(k) for k in range(template.period + 1)]), abs(barrier.normal[1])
    reach = max(float(np.abs(states.vertices[:, 0]).max()) for states in template.states)
    from_zmp = reach + template.half + float(np.abs(template.steps).max())
    change = template.tick * float(template.eta.max()) * from_zmp
    return float(gamma * (np.abs(bound).max() + scale * FASTEST) + np.abs(np.diff(bound)).max() + scale * change)
