"""Certified sets as terminal sets (20f) of the periodic MPC."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.barriers.invariant_set import InvariantSet
from pdhocbf_drake.certify.stepping_template import SteppingTemplate
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.terminal_set import TerminalSet

_NONE = 1e-9


def terminal_set(template: SteppingTemplate, sets: InvariantSet) -> TerminalSet:
    """The rows com·(c − f) + velocity·v + step·(f − f₋) ≤ bound of each phase.

    Where the coming step is chosen already, any choice will do for a plan that ends there: the old plan's own
    footholds are the choice. Where the box still moves away from the last foot, f₋ is one of the plan's footholds.

    Raises:
        InputError: there is no set.
    """
    if not sets.enforceable:
        raise InputError(
            f"there is no terminal set: from phase {sets.first_failing_phase} on no state can be kept within the limits"
        )
    rows, bounds = [], []
    for phase, part in enumerate(sets.sets):
        shape = part
        if template.chooses_steps and not (template.depends_on_step(phase) and not template.coming[phase]):
            shape = part.shadow(2)
        full = np.zeros((len(shape.A), 3))
        full[:, : shape.dimension] = shape.A
        keep = np.any(np.abs(full[:, :2]) > _NONE, axis=1)  # the rest are the limits of a step, which the MPC has
        rows.append(full[keep])
        bounds.append(shape.b[keep])
    return TerminalSet(template.axis, tuple(rows), tuple(bounds))
