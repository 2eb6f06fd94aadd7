"""Invariant sets of a walk under a bounded disturbance of each tick, and the largest one that leaves any.

The ZMP that acts at tick k is chosen at k − 1, because the MPC moves it by its velocity, and from x(k − 1 − d), the
last state that is known then where measurements are d ticks late. So the sets are those of the prediction z(k) of x(k)
that is made then, which the disturbances since make

    x(k) = z(k) + Σ_{i=k−d}^{k} Φ(k, i) w(i − 1),   z(k + 1) = A_k z(k) + B_k p(k) + c_k + Φ(k + 1, k − d) w(k − d − 1),
    Z_k = (X_k ⊖ ⊕_{i=k−d}^{k} Φ(k, i) W_{i−1}) ∩ Pre_k(Z_{k+1} ⊖ Φ(k + 1, k − d) W_{k−d−1}).

Without delay that is Z_k = (X_k ⊖ W_{k−1}) ∩ Pre_k(Z_{k+1} ⊖ A_k W_{k−1}); without a disturbance z = x. The set of the
ψ rows has ψ_1(k), and with it p(k), in its state, so that there the prediction of x(k) at k counts, whose

    C_k = (X_k ⊖ ⊕_{i=k−d+1}^{k} Φ(k, i) W_{i−1}) ∩ Pre_k(C_{k+1} ⊖ Φ(k + 1, k + 1 − d) W_{k−d})

says the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.config import Box
from pdhocbf_drake.sets.disturbance import TOLERANCE, Largest, largest_disturbance
from pdhocbf_drake.sets.invariant_set import InvariantSet, invariant_set
from pdhocbf_drake.sets.polytope import Array, Polytope
from pdhocbf_drake.studies.certify.psi_rows import psi_disturbance, psi_system
from pdhocbf_drake.studies.shared.stepping_template import SteppingTemplate

Sets = tuple[Polytope, ...]

_RESERVE = 2e-4
"""The sets withstand a disturbance that is larger by this share, so that no rounding decides whether one is met."""


@dataclass(frozen=True)
class Disturbance:
    """W_k = {w : |w_c| ≤ Δc_k, |w_v| ≤ Δv_k}, added to [c, v](k + 1) of an axis; a step that was chosen stays.

    Attributes:
        boxes: Δc, Δv of every tick of a step, or one for all ticks [m, m/s].
        delay: d, the age of what the controller measures [ticks].
        estimate: half-widths of the error of what is measured, where W_k holds all that its innovations are [m, m/s].
        scale: by which they are all multiplied.
    """

    boxes: tuple[Box, ...]
    delay: int = 0
    estimate: Box = (0.0, 0.0)
    scale: float = 1.0

    def points(self, k: int, size: int) -> Array:
        """The corners of W_k in the template's state, (w, size)."""
        return _corners(self.scale * np.array(self.boxes[k % len(self.boxes)]), size)

    def moved(self, template: SteppingTemplate, k: int, i: int) -> Array:
        """Φ(k, i) W_{i−1}: what a tick has added to x(i), at tick k ≥ i, as points."""
        points = self.points(i - 1, template.system.n)
        for j in range(i, k):
            points = points @ template.system.A(j).T
        return points

    def of_prediction(self, template: SteppingTemplate, ahead: int = 1) -> list[Array]:
        """By what predictions of x(k + 1), made at k + 1 − `ahead`, differ from those made before, for every phase."""
        return [self.moved(template, k + 1, k + 1 - ahead - self.delay) for k in range(template.period)]

    def left(
        self, template: SteppingTemplate, states: Sequence[Polytope | None], ahead: int = 1
    ) -> list[Polytope | None]:
        """X_k less all that is not known of x(k) at k − `ahead`; None where nothing is left."""
        parts = []
        for k, part in enumerate(states):
            unknown = [self.moved(template, k, i) for i in range(k, k - self.delay - ahead, -1)]
            if any(self.estimate):
                unknown.append(_corners(np.array(self.estimate), template.system.n))
            for points in unknown:
                part = None if part is None else part.less(points)
            parts.append(part)
        return parts

    def times(self, scale: float) -> Disturbance:
        """A multiple of the whole pattern."""
        return replace(self, scale=scale * self.scale)


def _corners(sides: Array, size: int) -> Array:
    corners = np.array(list(product(*({-side, side} for side in sides))))
    return np.hstack([corners, np.zeros((len(corners), size - 2))])


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
    left = disturbance.left(template, states)
    return invariant_set(template.system, left, template.inputs, disturbance=moved, within=within)


def psi_set(
    template: SteppingTemplate,
    barrier: AffineBarrier,
    enforced: AffineBarrier,
    disturbance: Disturbance | None = None,
    within: Sequence[Polytope] = (),
) -> InvariantSet | None:
    """The set of the ψ rows of the barrier that is `enforced`, in which the true state has h ≥ 0 of the given one.

    None where there is none to compute, see `psi_system`, or it is too flat.
    """
    moved: Sequence[Array] = ()
    try:
        if disturbance is not None and (disturbance.delay or any(disturbance.estimate)):
            left = disturbance.times(1.0 + _RESERVE).left(template, template.with_barriers([barrier]), 0)
            if None in left:
                return invariant_set(template.system, left, template.inputs)
            template = replace(template, states=tuple(part for part in left if part is not None))
        problem = psi_system(template, enforced)
        if problem is None:
            return None
        if disturbance is not None:
            points = disturbance.times(1.0 + _RESERVE).of_prediction(template, 0)
            moved = psi_disturbance(template, enforced, points)
        return invariant_set(*problem, disturbance=moved, within=within)
    except InputError:  # too flat for the geometry: a very small gamma
        return None


def largest(
    disturbance: Disturbance,
    here: InvariantSet | None,
    sets: Callable[[Disturbance, Sets], InvariantSet | None],
    undisturbed: InvariantSet | None = None,
    tolerance: float = TOLERANCE,
) -> Largest:
    """The largest multiple of a disturbance for which sets exist, from those at 1 and at 0 on, where they are known."""

    def solve(scale: float, within: Sets) -> InvariantSet:
        found = sets(disturbance.times(scale), within)
        if found is None:
            raise InputError("lost to rounding")
        return found

    known = [(scale, found) for scale, found in ((0.0, undisturbed), (1.0, here)) if found is not None]
    return largest_disturbance(solve, known, tolerance)
