"""Lemma 2: the stability row (33) and the terminal row (34) solved together, discretised to match and literally."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.mpc.axis_program import axis_program
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.mpc.solution import Reason
from pdhocbf_drake.qp.compiled import compile_program
from pdhocbf_drake.qp.solvers import QpSolver, make_solver

Array = NDArray[np.float64]
Row = tuple[Array, Array]
"""Coefficients (H,) of the inputs and (3,) of the state [c, v, p]; their sum is to be zero."""
Rows = Callable[[PeriodicMpc, int], list[Row]]


def matching(mpc: PeriodicMpc, phase: int) -> list[Row]:
    """(33) for the discretised template: Σ_i g_i u_i/Π_{j≤i} λ_j = (1 − Π λ⁻¹) e_k."""
    horizon = mpc.config.horizon
    left = 1.0 - mpc.divergent.discounts(phase, horizon)[-1]
    return [(mpc.divergent.input_weights(phase, horizon), -left * mpc.divergent.offset_row(phase))]


def matching_terminal(mpc: PeriodicMpc, phase: int) -> list[Row]:
    """(34) for the discretised template: e_{k+H} = e_k."""
    return [_returns(mpc, phase, mpc.divergent.offset_row(phase))]


def literal(mpc: PeriodicMpc, phase: int) -> list[Row]:
    """(33) with the letters' meaning put right (ω = √η of this tick), its exponentials as printed."""
    return [_printed(mpc, np.sqrt(mpc.vhip.eta[phase]))]


def literal_terminal(mpc: PeriodicMpc, phase: int) -> list[Row]:
    """(34) on the Euler model (23), with the same ω."""
    return [_returns(mpc, phase, np.array([1.0, 1.0 / np.sqrt(mpc.vhip.eta[phase]), -1.0]))]


def eta_for_omega(mpc: PeriodicMpc, phase: int) -> list[Row]:
    """(33) to the letter: the η of (22), in 1/s², where a rate in 1/s belongs."""
    return [_printed(mpc, mpc.vhip.eta[phase])]


VARIANTS: dict[str, Rows] = {
    "(33), matching": matching,
    "(34), matching": matching_terminal,
    "(33) and (34), matching": lambda mpc, phase: matching(mpc, phase) + matching_terminal(mpc, phase),
    "(33), literal": literal,
    "(34), literal": literal_terminal,
    "(33) and (34), literal": lambda mpc, phase: literal(mpc, phase) + literal_terminal(mpc, phase),
    "(33), η for ω": eta_for_omega,
}


def _printed(mpc: PeriodicMpc, rate: float) -> Row:
    delta, horizon = mpc.gait.config.tick, mpc.config.horizon
    factor = rate * (1 - np.exp(-horizon * rate * delta)) / (1 - np.exp(-rate * delta))
    return np.exp(-rate * delta * np.arange(horizon)), -factor * np.array([1.0, 1.0 / rate, -1.0])


def _returns(mpc: PeriodicMpc, phase: int, row: Array) -> Row:
    phi, gamma = mpc.vhip.prediction(phase, mpc.config.horizon)
    return row @ gamma[-1], row @ (phi[-1] - np.eye(3))


class Attempt(NamedTuple):
    """How far a variant walks.

    Attributes:
        planned: ticks until no solution was found.
        status: of the solver at the end.
        speed: forward CoM velocity, (planned,) [m/s].
        inputs: forward ZMP velocity, (planned,) [m/s].
    """

    planned: int
    status: str
    speed: Array
    inputs: Array


def attempt(mpc: PeriodicMpc, memory: Memory, first: int, ticks: int, rows: Rows) -> Attempt:
    """Walks on from a settled walk with these rows in place of the stability row, until no solution is found."""
    other = _OtherRows(mpc, rows)
    speed, inputs = [], []
    for row in walk_template(other, memory, first, ticks):
        if row.plan.fallbacks:
            break
        speed.append(row.state[0, 1])
        inputs.append(row.plan.inputs[0, 0])
    return Attempt(len(speed), other.status, np.array(speed), np.array(inputs))


class _OtherRows(PeriodicMpc):
    """The problem (36) of a walk without barriers, with other rows in place of the stability row.

    Attributes:
        status: "solved", or of the solver that found no solution.
    """

    def __init__(self, mpc: PeriodicMpc, rows: Rows) -> None:
        vars(self).update(vars(mpc))
        self.status = "solved"
        self._others = [[_solver(mpc, axis, phase, rows) for phase in range(mpc.gait.period)] for axis in (0, 1)]

    def solve(
        self, tick: int, state: Array, stance: Array, bounds: Mapping[str, Array],
        offset: Array | None = None, last: Plan | None = None, recovering: bool = False,
    ) -> Plan:  # fmt: skip
        """As `PeriodicMpc.solve`; without a solution the last plan again, marked as a fallback."""
        if last is None:
            raise RuntimeError("the attempt begins in the middle of a walk")
        horizon, found = self.config.horizon, []
        for axis in (0, 1):
            theta = self.theta(axis, tick, state[axis], stance[axis], bounds, offset, last)
            result = self._others[axis][tick % self.gait.period].solve(theta)
            if not result.ok:
                self.status = f"{result.status} ({'xy'[axis]})"
                return last._replace(tick=tick, fallbacks=1, reason=Reason.INFEASIBLE)
            found.append(result.decisions[: horizon + self.footholds])
        plans = np.stack(found)
        return last._replace(tick=tick, inputs=plans[:, :horizon], footholds=plans[:, horizon:])


def _solver(mpc: PeriodicMpc, axis: int, phase: int, rows: Rows) -> QpSolver:
    program = axis_program(mpc.gait, mpc.vhip, mpc.divergent, [], mpc.config, phase)
    prog, state = program.prog, program.parameters[mpc.layouts[axis].places["state"]]
    for binding in prog.GetAllConstraints():
        if binding.evaluator().get_description() == "stability":
            prog.RemoveConstraint(binding)
    for on_inputs, on_state in rows(mpc, phase):
        row = np.concatenate([on_inputs, on_state])
        # Scaled, so that the solver's tolerance means the same for every variant.
        row = row / np.abs(row).max()
        binding = prog.AddLinearEqualityConstraint(
            row[None], [0.0], np.concatenate([program.decisions[: mpc.config.horizon], state])
        )
        binding.evaluator().set_description("stability")
    return make_solver("clarabel", compile_program(prog, program.decisions, program.parameters))
