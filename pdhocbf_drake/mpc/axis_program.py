"""One axis of the periodic MPC (36), written as a `MathematicalProgram` with the current state as parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.solvers import Constraint, LinearConstraint, LinearEqualityConstraint, MathematicalProgram

from pdhocbf_drake.barriers import AffineBarrier, affine_rows
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.terminal_set import TerminalSet
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.divergent import DivergentComponent
from pdhocbf_drake.walking.vhip import Vhip


class Parameters:
    """The names and places of θ, everything of one axis that changes from tick to tick.

    state [c, v, p]; stance (last, this step's box centre); target f* and step_lower/step_upper of every coming step;
    half (half sides of the box: last, this, coming steps); tail (0 = truncated, see `AxisProgram`); offset (what the
    real ZMP is expected to differ from the template's at k + 1 … k + H); then the samples V̄(k) … V̄(k + H) of each
    barrier; last what the terminal set of each step in its period is relaxed by. All in SI units.
    """

    def __init__(self, footholds: int, horizon: int, barriers: Sequence[str], terminal_steps: int = 0) -> None:
        sizes = {"state": 3, "stance": 2, "target": footholds, "step_lower": footholds, "step_upper": footholds}
        sizes |= {"half": footholds + 2, "tail": 1, "offset": horizon}
        sizes |= {f"bound_{name}": horizon + 1 for name in barriers}
        sizes |= {"terminal": terminal_steps}
        self.places = layout(sizes)
        self.size = sum(sizes.values())


def layout(sizes: Mapping[str, int]) -> dict[str, slice]:
    """Where each named part lies in one long vector."""
    stops = np.cumsum(list(sizes.values()))
    return {name: slice(int(stop) - size, int(stop)) for (name, size), stop in zip(sizes.items(), stops, strict=True)}


@dataclass(frozen=True)
class AxisProgram:
    """The QP of one axis at one phase of the step, eq. (36).

    Decisions w = [u_0 … u_{H−1} (ZMP velocities [m/s]), f_1 … (centres of the coming stance feet [m]), slacks [m/s]];
    a soft barrier has one slack for each of its rows.

        min  Σ u² + ε Σ (f − f*)² + price of the ZMP's distance from the box's centre
             + Σ (linear price · slack + quadratic price · slack²)
        zmp_box_lower, zmp_box_upper   (27), with the box moving from foot to foot in double support
        stability                      Σ_i g_i u_i / Π_{j≤i} λ_j + tail = e_k
        step_lower, step_upper         limits of each coming step
        barrier NAME                   ψ_m(k + i) + slack_i ≥ 0, eq. (26)
        slack                          slack_i ≥ 0
        terminal set                   (20f), see `TerminalSet`; the stability row is then a quadratic price instead

    The stability row replaces (33) and (34), which say the same. Its tail parameter is Π λ⁻¹ e_{k+H}: Π λ⁻¹ e_k for
    the periodic tail (32), 0 for the truncated one, and the ZMP motion known beyond H for the anticipative one.
    """

    prog: MathematicalProgram
    decisions: np.ndarray
    parameters: np.ndarray
    inputs: int
    footholds: int


MISSED_TAIL = 1e8
"""Price of a missed tail, squared, in an elastic program [1/s²]: far above all else, so that little is missed."""

BOUND_ROWS = ("zmp_box_lower", "zmp_box_upper", "step_lower", "step_upper", "slack")
"""Constraints that are bounds after a linear change of variables (see `compile_program`)."""


def axis_program(
    gait: Gait,
    vhip: Vhip,
    divergent: DivergentComponent,
    barriers: Sequence[AffineBarrier],
    config: MpcConfig,
    phase: int,
    terminal: TerminalSet | None = None,
    elastic: bool = False,
) -> AxisProgram:
    """Writes the program of one axis for ticks with this phase; an elastic one demands no particular end."""
    horizon = config.horizon
    n_f = horizon // gait.period
    soft = bool(barriers) and config.barrier == "soft"
    steps_in_period = 0 if terminal is None else terminal.period // gait.period
    parameters = Parameters(n_f, horizon, [b.name for b in barriers], steps_in_period)

    prog = MathematicalProgram()
    u = prog.NewContinuousVariables(horizon, "u")
    f = prog.NewContinuousVariables(n_f, "f")
    theta = prog.NewContinuousVariables(parameters.size, "theta")
    part = {name: theta[place] for name, place in parameters.places.items()}
    feet = np.concatenate([part["stance"], f])

    _price(prog, 2.0 * np.eye(horizon), u, "zmp_velocity")
    eye = np.eye(n_f)
    missed = np.hstack([eye, -eye])
    _price(prog, 2.0 * config.foothold_weight * missed.T @ missed, np.concatenate([f, part["target"]]), "foothold")

    phi, gamma = vhip.prediction(phase, horizon)
    weights = gait.region.weights(phase, horizon, n_f)
    if config.zmp_centre_weight:
        rows = np.hstack([gamma[1:, 2], phi[1:, 2], -weights, np.eye(horizon)])
        hessian = 2.0 * config.zmp_centre_weight * rows.T @ rows
        variables = np.concatenate([u, part["state"], feet, part["offset"]])
        _price(prog, hessian, variables, "zmp_centre")
    box = gait.region.rows(phase, horizon, n_f)
    for side, (sign, on_feet, on_half) in zip(("lower", "upper"), box, strict=True):
        # the ZMP is p_{k+i} + offset_i
        rows = np.hstack([sign * gamma[1:, 2], sign * phi[1:, 2], on_feet, on_half, sign * np.eye(horizon)])
        variables = np.concatenate([u, part["state"], feet, part["half"], part["offset"]])
        _at_least_zero(prog, rows, variables, f"zmp_box_{side}")
        steps = np.hstack([sign * np.eye(n_f, n_f + 2, 1) * -1.0 + sign * np.eye(n_f, n_f + 2, 2), -sign * eye])
        _at_least_zero(prog, steps, np.concatenate([feet, part[f"step_{side}"]]), f"step_{side}")

    row = np.concatenate([divergent.input_weights(phase, horizon), -divergent.offset_row(phase), [1.0]])
    on = np.concatenate([u, part["state"], part["tail"]])
    if terminal is None and not elastic and config.stability == "demanded":
        _constrain(prog, LinearEqualityConstraint(row[None], np.zeros(1)), on, "stability")
    else:
        weight = MISSED_TAIL if elastic else config.tail_weight
        _price(prog, 2.0 * weight * np.outer(row, row), on, "stability")

    slacks = []
    for barrier in barriers:
        along = barrier.normal @ phi, barrier.normal @ gamma, np.zeros(horizon + 1)
        psi = affine_rows(barrier, vhip.system, phase, horizon, along)
        keep = psi.reachable  # the others are facts about the present that no input changes
        count = int(np.count_nonzero(keep)) if soft else 0
        slack = prog.NewContinuousVariables(count, f"slack_{barrier.name}")
        slacks.append(slack)
        rows = np.hstack(
            [psi.inputs[keep], psi.state[keep], psi.bounds[keep], np.eye(int(np.count_nonzero(keep)), count)]
        )
        variables = np.concatenate([u, part["state"], part[f"bound_{barrier.name}"], slack])
        _at_least_zero(prog, rows, variables, f"barrier {barrier.name}", -psi.constant[keep])
        if soft:
            linear, quadratic = config.slack_weight
            _price(prog, 2.0 * quadratic * np.eye(count), slack, "slack", np.full(count, linear))
            _at_least_zero(prog, np.eye(count), slack, "slack")
    if terminal is not None and not elastic:
        for step in range(steps_in_period):
            _add_terminal_rows(prog, terminal, step, gait.period, phase, (gamma[-2:], phi[-2:]), (u, part, feet))
    return AxisProgram(prog, np.concatenate([u, f, *slacks]), theta, horizon, n_f)


def _add_terminal_rows(
    prog: MathematicalProgram, terminal: TerminalSet, step: int, period: int, phase: int,
    last: tuple[np.ndarray, np.ndarray], variables: tuple[np.ndarray, dict[str, np.ndarray], np.ndarray],
) -> None:  # fmt: skip
    """(20f) for plans that end in the given step of the set's period; others relax it by a parameter."""
    rows, bounds = terminal.at_end_of(step * period + phase)
    (u, part, feet), at = variables, 1 - terminal.early
    com, velocity, length, following = rows.T[:, :, None]
    on_inputs, on_state = (com * m[at, 0] + velocity * m[at, 1] + following * m[1, 1] for m in last)
    # One tick before a step begins, the CoM is still counted from the foot before.
    stands_on = [1.0, 0.0] if phase < terminal.early else [0.0, 1.0]
    lhs = np.hstack([on_inputs, on_state, length * [-1.0, 1.0] - com * stands_on])
    relaxed = part["terminal"][step : step + 1]
    vector = np.concatenate([u, part["state"], feet[-2:], relaxed])
    _at_least_zero(prog, np.hstack([-lhs, np.ones((len(rows), 1))]), vector, "terminal set", -bounds)


def _price(
    prog: MathematicalProgram, hessian: np.ndarray, variables: np.ndarray, name: str, linear: np.ndarray | None = None
) -> None:
    """A cost that is convex as it is written, which Drake need not find out."""
    slope = np.zeros(len(hessian)) if linear is None else linear
    prog.AddQuadraticCost(hessian, slope, variables, True).evaluator().set_description(name)


def _at_least_zero(
    prog: MathematicalProgram, rows: np.ndarray, variables: np.ndarray, name: str, lower: np.ndarray | None = None
) -> None:
    least = np.zeros(len(rows)) if lower is None else lower
    _constrain(prog, LinearConstraint(rows, least, np.full(len(rows), np.inf)), variables, name)


def _constrain(prog: MathematicalProgram, constraint: Constraint, variables: np.ndarray, name: str) -> None:
    """`prog.AddLinearConstraint` would do the same, but loads scipy to see whether its matrix is sparse."""
    constraint.set_description(name)
    prog.AddConstraint(constraint, variables)
