"""Certified sets as terminal sets (20f) of the periodic MPC."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.barriers.recursion import linear_rates
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.terminal_set import TerminalSet
from pdhocbf_drake.sets.invariant_set import InvariantSet
from pdhocbf_drake.sets.polytope import Array, support
from pdhocbf_drake.studies.certify.certificate import BoundCertificate
from pdhocbf_drake.studies.certify.disturbed import Disturbance
from pdhocbf_drake.studies.certify.psi_rows import psi_disturbance
from pdhocbf_drake.studies.certify.scenario_certificate import ScenarioCertificate
from pdhocbf_drake.studies.shared.stepping_template import SteppingTemplate

_NONE = 1e-9


def terminal_sets(found: ScenarioCertificate) -> dict[int, TerminalSet]:
    """The terminal set of each axis for a scenario's MPC; under a hard barrier that of the barrier's ψ rows.

    Raises:
        InputError: there is no such set, or it can't be computed; see `terminal_set` and `psi_terminal_set`.
    """
    hard = found.scenario.mpc.barrier == "hard"
    return {
        axis: psi_terminal_set(c.template, c.bounds, c.disturbance)
        if hard and c.bounds
        else terminal_set(c.template, c.kept, c.disturbance)
        for axis, c in enumerate(found.axes)
    }


def terminal_set(template: SteppingTemplate, sets: InvariantSet, disturbance: Disturbance | None = None) -> TerminalSet:
    """The rows com·(c − f) + velocity·v + step·(f − f₋) ≤ bound of each phase.

    Where the coming step is chosen already, the choice is that of the plan which ends there, so the set is projected
    onto (c, v). Where the box still moves away from the last foot, f₋ is one of the plan's footholds.

    Under a disturbance the rows of the plan's second tick are those of Z_k less what the prediction of x(k) changes by
    in a tick, see `disturbed`.

    Raises:
        InputError: there is no set.
    """
    _check_enforceable(sets)
    rows, bounds = [], []
    for phase, part in enumerate(sets.sets):
        needs_step = template.depends_on_step(phase) and not template.coming[phase]
        shape = part.shadow(2) if template.chooses_steps and not needs_step else part
        full = np.zeros((len(shape.A), 4))
        full[:, : shape.dimension] = shape.A
        keep = np.any(np.abs(full[:, :2]) > _NONE, axis=1)  # the rest are the limits of a step, which the MPC has
        rows.append(full[keep])
        bounds.append(shape.b[keep])
    if disturbance is None:
        return TerminalSet(template.axis, tuple(rows), tuple(bounds))
    first = [
        _first(template, q, part.A[:, :2], part.A[:, 2:], np.zeros((len(part.A), 1)), part.b - support(part.A, moved))
        for q, (part, moved) in enumerate(zip(sets.sets, _before(disturbance.of_prediction(template)), strict=True))
    ]
    return TerminalSet(template.axis, tuple(rows), tuple(bounds), 0, *zip(*first, strict=True))


def _before(of_phase: Sequence[Array]) -> list[Array]:
    """What belongs to the phase before each phase."""
    return [*of_phase[-1:], *of_phase[:-1]]


def _first(
    template: SteppingTemplate, phase: int, on_state: Array, on_step: Array, on_following: Array, bounds: Array
) -> tuple[Array, Array]:
    """`TerminalSet.first` and `.first_bounds` at a phase; on_step (r, 1), or (r, 0) where steps are given."""
    step = on_step if on_step.size else np.zeros((len(on_state), 1))
    last, coming = (0.0 * step, step) if template.coming[phase] else (step, 0.0 * step)
    rows = np.hstack([on_state, last, on_following, coming])
    keep = np.any(np.abs(rows[:, [0, 1, 3]]) > _NONE, axis=1)  # the rest are the limits of a step, which the MPC has
    return rows[keep], bounds[keep]


def psi_terminal_set(
    template: SteppingTemplate, bounds: Sequence[BoundCertificate], disturbance: Disturbance | None = None
) -> TerminalSet:
    """The set of a hard barrier's rows, written with v(k) and v(k+1) in place of ψ_1(k).

    ψ_1 = h(k+1) − (1 − γ_1) h(k) with h = ± (V̄ − n v), so the set applies one tick before the plan ends. A plan that
    ends with a step has chosen that step; where a later one is chosen already, the set is projected onto (c, v, ψ_1).

    Raises:
        InputError: there is not exactly one barrier, or its rows were not certified, or they can't be kept.
    """
    barrier, sets = hard_rows(bounds)
    keep, scale = 1.0 - linear_rates(barrier)[0], barrier.sign * float(barrier.normal[1])
    last = template.ticks_per_step - 1
    all_rows, all_bounds = [], []
    first: list[tuple[Array, Array]] = []
    moved = None if disturbance is None else psi_disturbance(template, barrier, disturbance.of_prediction(template, 0))
    for phase, part in enumerate(sets.sets):
        ends_with_step = phase % template.ticks_per_step == last
        needs_step = template.depends_on_step(phase) and (ends_with_step or not template.coming[phase])
        shape = part.shadow(3) if template.chooses_steps and not needs_step else part
        rows = np.zeros((len(shape.A), 4))
        rows[:, :2] = shape.A[:, :2]
        rows[:, 2] = shape.A[:, 3] if shape.dimension == 4 else 0.0
        on_psi = shape.A[:, 2]
        rows[:, 1] += on_psi * scale * keep
        rows[:, 3] = -on_psi * scale
        of_bound = barrier.sign * (barrier.bound(phase + 1) - keep * barrier.bound(phase))
        used = np.any(np.abs(rows[:, [0, 1, 3]]) > _NONE, axis=1)
        all_rows.append(rows[used])
        all_bounds.append((shape.b - on_psi * of_bound)[used])
        if moved is not None:
            on_psi, on_state = part.A[:, 2], part.A[:, :2].copy()
            on_state[:, 1] += on_psi * scale * keep
            left = part.b - on_psi * of_bound - support(part.A, moved[phase - 1])
            first.append(_first(template, phase, on_state, part.A[:, 3:], -(on_psi * scale)[:, None], left))
    early = tuple(zip(*first, strict=True)) if first else ((), ())
    return TerminalSet(template.axis, tuple(all_rows), tuple(all_bounds), 1, *early)


def hard_rows(bounds: Sequence[BoundCertificate]) -> tuple[AffineBarrier, InvariantSet]:
    """The barrier of an axis with a hard one, and the set of its ψ rows; raises as `psi_terminal_set` does."""
    if len(bounds) != 1:
        raise InputError(f"a terminal set is made for one hard barrier an axis, not for {len(bounds)} together")
    barrier, sets = bounds[0].enforced, bounds[0].rows
    if sets is None:
        raise InputError(f'a hard barrier needs the set of its psi rows, and there is none for "{barrier.name}"')
    _check_enforceable(sets)
    return barrier, sets


def _check_enforceable(sets: InvariantSet) -> None:
    if not sets.enforceable:
        raise InputError(
            f"there is no terminal set: from phase {sets.first_failing_phase} on no state can be kept within the limits"
        )
