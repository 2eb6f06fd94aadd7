"""The certificate of one axis: its invariant sets without a bound, under each bound, and under all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.invariant_set import InvariantSet, broken_phases, invariant_set
from pdhocbf_drake.sets.polytope import Polytope
from pdhocbf_drake.studies.certify.psi_rows import psi_system
from pdhocbf_drake.studies.certify.stepping_template import SteppingTemplate


@dataclass(frozen=True)
class BoundCertificate:
    """The invariant sets of one barrier h on the template.

    Attributes:
        barrier: the barrier.
        kept: the states from which h ≥ 0 can be kept for ever. Where there are some, the bound is enforceable.
        rows: the same for ψ_m ≥ 0 with the barrier's own class-K functions, in a larger state; None if it was not
            computed or can't be (see `psi_system`, or a gamma so small that the sets are flat).
        failing: phases at which h ≥ 0 alone is *not* a barrier: some state that could walk on for ever, with h ≥ 0
            now, must break h ≥ 0 or fall at the next tick, whatever its ZMP. There `kept` is smaller than the part
            of the unbounded set with h ≥ 0.
    """

    barrier: AffineBarrier
    kept: InvariantSet
    rows: InvariantSet | None
    failing: tuple[int, ...]


@dataclass(frozen=True)
class AxisCertificate:
    """The certified sets of one axis.

    Attributes:
        template: the dynamics and limits.
        unbounded: the set without barriers: from it one can walk on for ever.
        kept: the set under all barriers of this axis together.
        bounds: each barrier by itself.
    """

    template: SteppingTemplate
    unbounded: InvariantSet
    kept: InvariantSet
    bounds: tuple[BoundCertificate, ...]

    def section(self, phase: int, sets: InvariantSet | None = None) -> Polytope | None:
        """The set in (c, v) at a phase, by default under all barriers; see `section`."""
        return section(self.template, self.kept if sets is None else sets, phase)


def certify_axis(
    template: SteppingTemplate, barriers: Sequence[AffineBarrier], with_rows: bool = True
) -> AxisCertificate:
    """Computes the sets of one axis.

    Args:
        template: the dynamics and limits.
        barriers: those on this axis.
        with_rows: also certify each barrier's ψ rows, which takes a set of one more dimension.

    Raises:
        InputError: a barrier that can't be certified here, or sets that don't converge.
    """
    unbounded = invariant_set(template.system, template.states, template.inputs)
    bounds = []
    for barrier in barriers:
        kept = _kept(template, [barrier])
        rows = _psi_set(template, barrier) if with_rows else None
        bounds.append(BoundCertificate(barrier, kept, rows, _failing(template, unbounded, barrier)))
    if not barriers:
        return AxisCertificate(template, unbounded, unbounded, ())
    kept = bounds[0].kept if len(barriers) == 1 else _kept(template, barriers)
    return AxisCertificate(template, unbounded, kept, tuple(bounds))


def section(template: SteppingTemplate, sets: InvariantSet, phase: int) -> Polytope | None:
    """The set in (c, v) at a phase: where the step is chosen already, for the commanded one. None if empty."""
    if not sets.enforceable:
        return None
    part = sets.sets[phase % template.period]
    if not template.chooses_steps:
        return part
    return part.slice(template.held[phase % template.period])


def area(part: Polytope | None) -> float:
    """[m²/s]."""
    return 0.0 if part is None else part.volume()


def _kept(template: SteppingTemplate, barriers: Sequence[AffineBarrier]) -> InvariantSet:
    limited = template.with_barriers(barriers)
    if isinstance(limited, int):
        return InvariantSet((), limited, 0, np.nan, 0.0)
    return invariant_set(template.system, limited, template.inputs)


def _psi_set(template: SteppingTemplate, barrier: AffineBarrier) -> InvariantSet | None:
    problem = psi_system(template, barrier)
    if problem is None:
        return None
    if isinstance(problem, int):
        return InvariantSet((), problem, 0, np.nan, 0.0)
    try:
        return invariant_set(*problem)
    except InputError:  # too flat for the geometry: a very small gamma
        return None


def _failing(template: SteppingTemplate, unbounded: InvariantSet, barrier: AffineBarrier) -> tuple[int, ...]:
    """Phases at which the set {h ≥ 0} within the unbounded one does not lead into itself."""
    if not unbounded.enforceable:
        return tuple(range(template.period))
    parts = []
    for phase, part in enumerate(unbounded.sets):
        normal = np.zeros(template.system.n)
        normal[:2] = barrier.sign * barrier.normals(phase, 1)[0, :2]
        limit = barrier.sign * barrier.bound(phase)
        parts.append(Polytope.from_rows(np.vstack([part.A, normal]), np.append(part.b, limit)))
    return broken_phases(template.system, parts, template.inputs)
