"""Invariant sets of a walk under a bounded disturbance a tick, and the largest one that leaves any.

The ZMP that acts at tick k is chosen at k − 1, from x(k − 1), because the MPC moves it by its velocity. So the sets
are those of the prediction z(k) = A x(k − 1) + B p(k − 1) + c, which is known then, while x(k) = z(k) + w(k − 1):

    z(k + 1) = A_k z(k) + B_k p(k) + c_k + A_k w(k − 1),   Z_k = (X_k ⊖ W) ∩ Pre_k(Z_{k+1} ⊖ A_k W).

Without a disturbance z = x. The set of the ψ rows has ψ_1(k), and with it p(k), in its state, so that there
C_k = X_k ∩ Pre_k(C_{k+1} ⊖ W) itself says the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.disturbance import Largest, largest_disturbance
from pdhocbf_drake.sets.invariant_set import InvariantSet, invariant_set
from pdhocbf_drake.sets.polytope import Array, Polytope
from pdhocbf_drake.studies.certify.psi_rows import psi_disturbance, psi_system
from pdhocbf_drake.studies.shared.stepping_template import SteppingTemplate

Sets = tuple[Polytope, ...]

_RESERVE = 2e-4
"""The sets withstand a disturbance that is larger by this share, so that no rounding decides whether one is met."""


@dataclass(frozen=True)
class Disturbance:
    """W = {w : |w_c| ≤ Δc, |w_v| ≤ Δv}, added to [c, v](k + 1) at every tick; a step that was chosen stays.

    Attributes:
        half_widths: Δc, Δv [m, m/s].
        scale: by which they are multiplied.
    """

    half_widths: tuple[float, float]
    scale: float = 1.0

    def points(self, size: int) -> Array:
        """The corners of W in the template's state, (w, size)."""
        com, velocity = self.scale * np.array(self.half_widths)
        corners = np.array(list(product(*({-side, side} for side in (com, velocity)))))
        return np.hstack([corners, np.zeros((len(corners), size - 2))])

    def of_prediction(self, template: SteppingTemplate) -> list[Array]:
        """A_k W of every phase, as points."""
        points = self.points(template.system.n)
        return [points @ template.system.A(k).T for k in range(template.period)]

    def left(self, states: Sequence[Polytope | None]) -> list[Polytope | None]:
        """X_k ⊖ W; None where nothing is left."""
        return [None if part is None else part.less(self.points(part.dimension)) for part in states]

    def times(self, scale: float) -> Disturbance:
        """A multiple."""
        return replace(self, scale=scale * self.scale)


def walk_sets(
    template: SteppingTemplate,
    barriers: Sequence[AffineBarrier],
    disturbance: Disturbance | None = None,
    within: Sequence[Polytope] = (),
) -> InvariantSet:
    """Z_k under some barriers; `within` as in `invariant_set`."""
    states: Sequence[Polytope | None] = template.with_barriers(barriers) if barriers else template.states
    if disturbance is None:
        return invariant_set(template.system, states, template.inputs)
    disturbance = disturbance.times(1.0 + _RESERVE)
    moved = disturbance.of_prediction(template)
    left = disturbance.left(states)
    return invariant_set(template.system, left, template.inputs, disturbance=moved, within=within)


def psi_set(
    template: SteppingTemplate,
    barrier: AffineBarrier,
    disturbance: Disturbance | None = None,
    within: Sequence[Polytope] = (),
) -> InvariantSet | None:
    """The set of a barrier's ψ rows; None where there is none to compute, see `psi_system`, or it is too flat."""
    try:
        problem = psi_system(template, barrier)
        if problem is None:
            return None
        moved: Sequence[Array] = ()
        if disturbance is not None:
            points = disturbance.times(1.0 + _RESERVE).points(template.system.n)
            moved = psi_disturbance(template, barrier, points)
        return invariant_set(*problem, disturbance=moved, within=within)
    except InputError:  # too flat for the geometry: a very small gamma
        return None


def largest(
    disturbance: Disturbance,
    here: InvariantSet | None,
    sets: Callable[[Disturbance, Sets], InvariantSet | None],
    undisturbed: InvariantSet | None = None,
) -> Largest:
    """The largest multiple of a disturbance for which sets exist, from those at 1 and at 0 on, where they are known."""

    def solve(scale: float, within: Sets) -> InvariantSet:
        found = sets(disturbance.times(scale), within)
        if found is None:
            raise InputError("lost to rounding")
        return found

    known = [(scale, found) for scale, found in ((0.0, undisturbed), (1.0, here)) if found is not None]
    return largest_disturbance(solve, known)
