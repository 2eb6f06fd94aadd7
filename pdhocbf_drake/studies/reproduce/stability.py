"""Lemma 2: the stability row (33) and the terminal row (34) solved together, discretised to match and literally."""

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
from pdhocbf_drake.mpc.terms.term import Setting, Term

Array = NDArray[np.float64]
Row = tuple[Array, Array]
"""Coefficients (H,) of the inputs and (3,) of the state [c, v, p]; their sum is to be zero."""
Rows = Callable[[Setting, int], list[Row]]


def matching(setting: Setting, phase: int) -> list[Row]:
    """(33) for the discretised template: Σ_i g_i u_i/Π_{j≤i} λ_j = (1 − Π λ⁻¹) e_k."""
    divergent, horizon = setting.divergent, setting.config.horizon
    left = 1.0 - divergent.discounts(phase, horizon)[-1]
    return [(divergent.input_weights(phase, horizon), -left * divergent.offset_row(phase))]


def matching_terminal(setting: Setting, phase: int) -> list[Row]:
    """(34) for the discretised template: e_{k+H} = e_k."""
    return [_returns(setting, phase, setting.divergent.offset_row(phase))]


def literal(setting: Setting, phase: int) -> list[Row]:
    """(33) with the letters' meaning put right (ω = √η of this tick), its exponentials as printed."""
    return [_printed(setting, np.sqrt(setting.vhip.eta[phase]))]


def literal_terminal(setting: Setting, phase: int) -> list[Row]:
    """(34) on the Euler model (23), with the same ω."""
    return [_returns(setting, phase, np.array([1.0, 1.0 / np.sqrt(setting.vhip.eta[phase]), -1.0]))]


def eta_for_omega(setting: Setting, phase: int) -> list[Row]:
    """(33) to the letter: the η of (22), in 1/s², where a rate in 1/s belongs."""
    return [_printed(setting, setting.vhip.eta[phase])]


VARIANTS: dict[str, Rows] = {
    "(33), matching": matching,
    "(34), matching": matching_terminal,
    "(33) and (34), matching": lambda setting, phase: matching(setting, phase) + matching_terminal(setting, phase),
    "(33), literal": literal,
    "(34), literal": literal_terminal,
    "(33) and (34), literal": lambda setting, phase: literal(setting, phase) + literal_terminal(setting, phase),
    "(33), η for ω": eta_for_omega,
}


def _printed(setting: Setting, rate: float) -> Row:
    delta, horizon = setting.gait.config.tick, setting.config.horizon
    factor = rate * (1 - np.exp(-horizon * rate * delta)) / (1 - np.exp(-rate * delta))
    return np.exp(-rate * delta * np.arange(horizon)), -factor * np.array([1.0, 1.0 / rate, -1.0])


def _returns(setting: Setting, phase: int, row: Array) -> Row:
    phi, gamma = setting.vhip.prediction(phase, setting.config.horizon)
    return row @ gamma[-1], row @ (phi[-1] - np.eye(3))


class Attempt(NamedTuple):
    """How far a variant walks.

    Attributes:
        planned: ticks until no solution was found.
        reason: of the last plan.
        speed: forward CoM velocity, (planned,) [m/s].
    """

    planned: int
    reason: Reason
    speed: Array


def attempt(mpc: PeriodicMpc, memory: Memory, first: int, ticks: int, rows: Rows) -> Attempt:
    """Walks on from a settled walk without barriers, with these rows in place of the stability row.

    Args:
        mpc: the problem (36) with the stability row.
        memory: of the settled walk before tick `first`.
        first: the first tick.
        ticks: after which the attempt ends, if it has a solution at each of them.
        rows: one of `VARIANTS`.
    """
    kinds: list[type[Term]] = [_demanding(rows) if kind is Stability else kind for kind in TERMS]
    config = mpc.config.model_copy(update={"solver": "clarabel"})
    other = PeriodicMpc(mpc.gait, mpc.vhip, config, ([], []), on_demand=True, kinds=kinds)
    speed, reason = [], Reason.SOLVED
    for row in walk_template(other, memory, first, ticks):
        reason = row.plan.reason
        if reason != Reason.SOLVED:
            break
        speed.append(row.state[0, 1])
    return Attempt(len(speed), reason, np.array(speed))


def _demanding(rows: Rows) -> type[Stability]:
    """The kind of term that demands these rows in place of the stability row."""

    class Other(Stability):
        def write(self, program: AxisProgram) -> None:
            variables = np.concatenate([program.u, program.part["state"]])
            for on_inputs, on_state in rows(self.setting, program.phase):
                row = np.concatenate([on_inputs, on_state])
                # Scaled, so that the solver's tolerance means the same for every variant.
                program.equal_zero(row[None] / np.abs(row).max(), variables, "stability")

    return Other
