"""Lemma 2: the stability row (33) and the terminal row (34) solved together, discretised to match and literally."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.mpc.axis_program import axis_program
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.qp.compiled import compile_program
from pdhocbf_drake.qp.solvers import QpSolver, make_solver
from pdhocbf_drake.simulation.build import Walk

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
        status: the solver's word at the end.
        speed: forward CoM velocity, (planned,) [m/s].
        inputs: forward ZMP velocity, (planned,) [m/s].
    """

    planned: int
    status: str
    speed: Array
    inputs: Array


def attempt(walk: Walk, memory: Memory, first: int, ticks: int, rows: Rows) -> Attempt:
    """Walks on from a settled walk with these rows in place of the stability row, until no solution is found."""
    mpc = walk.mpc
    solvers = [[_solver(mpc, axis, phase, rows) for phase in range(mpc.gait.period)] for axis in (0, 1)]
    memory = memory.copy()
    speed: list[float] = []
    inputs: list[float] = []
    horizon, n_f = mpc.config.horizon, mpc.footholds
    for k in range(first, first + ticks):
        found = []
        for axis in (0, 1):
            theta = mpc.theta(axis, k, memory.state[axis], memory.stance[axis], {}, None, memory.plan)
            result = solvers[axis][k % mpc.gait.period].solve(theta)
            if not result.ok:
                return Attempt(k - first, f"{result.status} ({'xy'[axis]})", np.array(speed), np.array(inputs))
            found.append(result.decisions[: horizon + n_f])
        plans = np.stack(found)
        if memory.plan is None:
            raise RuntimeError("the attempt begins in the middle of a walk")
        plan = memory.plan._replace(tick=k, inputs=plans[:, :horizon], footholds=plans[:, horizon:])
        speed.append(memory.state[0, 1])
        inputs.append(plan.inputs[0, 0])
        memory.advance(mpc, memory.state, plan)
    return Attempt(ticks, "solved", np.array(speed), np.array(inputs))


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
