"""Lemma 2: the stability row (33) and the terminal row (34), discretised to match and as printed, as terms of (36)."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.mpc.terms import TERMS
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.stability import Stability
from pdhocbf_drake.mpc.terms.term import Setting

Array = NDArray[np.float64]
Row = tuple[Array, Array]
"""Coefficients (H,) of the inputs and (3,) of the state [c, v, p]; their sum is zero."""


def matching(setting: Setting, phase: int) -> Row:
    """(33) for the discretised template: Σ_i g_i u_i/Π_{j≤i} λ_j = (1 − Π λ⁻¹) e_k."""
    divergent, horizon = setting.divergent, setting.config.horizon
    left = 1.0 - divergent.discounts(phase, horizon)[-1]
    return divergent.input_weights(phase, horizon), -left * divergent.offset_row(phase)


def matching_terminal(setting: Setting, phase: int) -> Row:
    """(34) for the discretised template: e_{k+H} = e_k."""
    return _periodic(setting, phase, setting.divergent.offset_row(phase))


def literal(setting: Setting, phase: int) -> Row:
    """(33) with the exponentials as printed, and the rate ω = √η of this tick."""
    return _printed(setting, np.sqrt(setting.vhip.eta[phase]))


def literal_terminal(setting: Setting, phase: int) -> Row:
    """(34) on the Euler model (23), with the same ω."""
    return _periodic(setting, phase, np.array([1.0, 1.0 / np.sqrt(setting.vhip.eta[phase]), -1.0]))


def eta_for_omega(setting: Setting, phase: int) -> Row:
    """(33) to the letter: the η of (22), in 1/s², where a rate in 1/s belongs."""
    return _printed(setting, setting.vhip.eta[phase])


def _printed(setting: Setting, rate: float) -> Row:
    delta, horizon = setting.gait.config.tick, setting.config.horizon
    factor = rate * (1 - np.exp(-horizon * rate * delta)) / (1 - np.exp(-rate * delta))
    return np.exp(-rate * delta * np.arange(horizon)), -factor * np.array([1.0, 1.0 / rate, -1.0])


def _periodic(setting: Setting, phase: int, row: Array) -> Row:
    """row · [c, v, p](k + H) = row · [c, v, p](k)."""
    phi, gamma = setting.vhip.prediction(phase, setting.config.horizon)
    return row @ gamma[-1], row @ (phi[-1] - np.eye(3))


def _demanding(*equations: Callable[[Setting, int], Row]) -> type[Stability]:
    """The kind of term that demands these rows in place of the stability row."""

    class OtherRows(Stability):
        def write(self, program: AxisProgram) -> None:
            variables = np.concatenate([program.u, program.part["state"]])
            for equation in equations:
                row = np.concatenate(equation(self.setting, program.phase))
                # Scaled, so that the solver's tolerance means the same for every variant.
                program.equal_zero(row[None] / np.abs(row).max(), variables, *self.rows)

    return OtherRows


VARIANTS = {
    "(33), matching": _demanding(matching),
    "(34), matching": _demanding(matching_terminal),
    "(33) and (34), matching": _demanding(matching, matching_terminal),
    "(33), literal": _demanding(literal),
    "(34), literal": _demanding(literal_terminal),
    "(33) and (34), literal": _demanding(literal, literal_terminal),
    "(33), η for ω": _demanding(eta_for_omega),
}
"""By name, the kind of term that takes the place of `mpc.terms.Stability`."""


class Attempt(NamedTuple):
    """How far a variant walks.

    Attributes:
        planned: ticks before the first one without a solution.
        reason: of the last plan.
        speed: forward CoM velocity, (planned,) [m/s].
    """

    planned: int
    reason: Reason
    speed: Array


def attempt(mpc: PeriodicMpc, memory: Memory, first: int, ticks: int, variant: type[Stability]) -> Attempt:
    """Walks on from a settled walk without barriers, with this variant of the stability term, until a tick is unsolved.

    Args:
        mpc: the problem (36) with the stability row.
        memory: of the settled walk before tick `first`.
        first: the first tick.
        ticks: how many at most.
        variant: one of `VARIANTS`.
    """
    kinds = [variant if kind is Stability else kind for kind in TERMS]
    config = mpc.config.model_copy(update={"solver": "clarabel"})
    other = PeriodicMpc(mpc.gait, mpc.vhip, config, ([], []), on_demand=True, kinds=kinds)
    speed, reason = [], Reason.SOLVED
    for row in walk_template(other, memory, first, ticks):
        reason = row.plan.reason
        if reason != Reason.SOLVED:
            break
        speed.append(row.state[0, 1])
    return Attempt(len(speed), reason, np.array(speed))
