"""The terms of problem (36), one file each; a new term is a file here and a line in `TERMS`."""

from __future__ import annotations

from collections.abc import Sequence

from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.terms.barrier import BarrierTerm
from pdhocbf_drake.mpc.terms.coupled_tail import CoupledTail
from pdhocbf_drake.mpc.terms.effort import Effort
from pdhocbf_drake.mpc.terms.footholds import Footholds
from pdhocbf_drake.mpc.terms.held_zmp import HeldZmpBox
from pdhocbf_drake.mpc.terms.stability import Stability
from pdhocbf_drake.mpc.terms.step_limits import StepLimits
from pdhocbf_drake.mpc.terms.term import Term
from pdhocbf_drake.mpc.terms.terminal import TerminalRows
from pdhocbf_drake.mpc.terms.zmp_box import ZmpBox
from pdhocbf_drake.mpc.terms.zmp_centre import ZmpCentre
from pdhocbf_drake.mpc.terms.zmp_velocity import ZmpVelocity

TERMS: tuple[type[Term], ...] = (
    Effort,
    Footholds,
    ZmpCentre,
    Stability,
    CoupledTail,
    ZmpBox,
    HeldZmpBox,
    StepLimits,
    ZmpVelocity,
    BarrierTerm,
    TerminalRows,
)
"""In the order in which they are written."""


def constraints_of(config: MpcConfig, kinds: Sequence[type[Term]] = TERMS) -> dict[str, str]:
    """What a plan of a problem with these kinds of terms may miss, with its unit, in the order of `Plan.unmet`."""
    rows = [row for kind in kinds if kind.configured(config) for row in kind.rows.values() if row.missed_as]
    return {row.missed_as: row.unit for row in rows}
