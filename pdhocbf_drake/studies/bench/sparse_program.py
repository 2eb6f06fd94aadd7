"""The program of `mpc.axis_problem` in the form that suits interior-point solvers: states as variables, short rows."""

from __future__ import annotations

import numpy as np
from pydrake.solvers import MathematicalProgram

from pdhocbf_drake.barriers import affine_rows
from pdhocbf_drake.barriers.recursion import linear_rates, psi_coefficients
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.terms.step_limits import StepLimits
from pdhocbf_drake.qp import ParametricQp, compile_program
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.walking.walk_barrier import WalkBarrier


def sparse_qp(walk: Walk, axis: int, phase: int) -> ParametricQp:
    """The compiled program of one axis and phase in [u, f, slacks, s_1 … s_H], with the same θ and the same optimum.

    Without a barrier on the CoM, the states are the ZMP alone, and the stability row is the one in u. The first
    decisions are those of `AxisProblem`, so that answers can be compared entry by entry.
    """
    mpc, gait, vhip = walk.mpc, walk.gait, walk.vhip
    config, horizon, n_f = mpc.config, mpc.config.horizon, mpc.footholds
    barriers = mpc.barriers[axis]
    for barrier in barriers:
        if isinstance(barrier, WalkBarrier) and barrier.seen_anew:
            raise InputError(
                f'barrier "{barrier.name}": other solvers are compared on barriers that do not change with the stance '
                f"foot, given one on {barrier.quantity.name}"
            )
    soft = bool(barriers) and config.barrier == "soft"
    problem = mpc.problems[axis]
    prog = MathematicalProgram()
    theta = prog.NewContinuousVariables(problem.size, "theta")
    part = {name: theta[place] for name, place in problem.places.items()}
    u, f = prog.NewContinuousVariables(horizon, "u"), prog.NewContinuousVariables(n_f, "f")
    states = prog.NewContinuousVariables(3 * horizon if barriers else horizon, "s")
    path = np.full((horizon + 1, 3), None)
    path[0] = part["state"]
    path[1:, slice(0 if barriers else 2, 3)] = states.reshape(horizon, -1)
    feet = np.concatenate([part["stance"], f])

    prog.AddQuadraticCost(2.0 * np.eye(horizon), np.zeros(horizon), u)
    eye = np.eye(n_f)
    pair = 2.0 * config.foothold_weight * np.block([[eye, -eye], [-eye, eye]])
    prog.AddQuadraticCost(pair, np.zeros(2 * n_f), np.concatenate([f, part["target"]]))

    kept = slice(0 if barriers else 2, 3)
    for i in range(horizon):
        A, B = vhip.A[(phase + i) % vhip.period][kept, kept], vhip.B[(phase + i) % vhip.period][kept]
        rows = np.hstack([A, B[:, None], -np.eye(len(B))])
        before = path[i, kept]
        variables = np.concatenate([before, u[i : i + 1], path[i + 1, kept]])
        prog.AddLinearEqualityConstraint(rows, np.zeros(len(B)), variables)
    box = gait.region.rows(phase, horizon, n_f)
    for step, (sign, on_feet, on_half) in zip(StepLimits.rows, box, strict=True):
        rows = np.hstack([sign * np.eye(horizon), on_feet, on_half, sign * np.eye(horizon)])
        variables = np.concatenate([path[1:, 2], feet, part["half"], part["zmp_offset"]])
        prog.AddLinearConstraint(rows, np.zeros(horizon), np.full(horizon, np.inf), variables)
        moves = sign * np.hstack([np.eye(n_f, n_f + 2, 2) - np.eye(n_f, n_f + 2, 1), -eye])
        prog.AddLinearConstraint(moves, np.zeros(n_f), np.full(n_f, np.inf), np.concatenate([feet, part[step]]))
    if barriers:  # the stability condition is one on the last state: e_{k+H} = tail / Π λ⁻¹
        discount = mpc.divergent.discounts(phase, horizon)[-1]
        row = np.append(discount * mpc.divergent.offset_row(phase + horizon), -1.0)
        variables = np.append(path[-1], part["tail"])
    else:
        row = np.concatenate([mpc.divergent.input_weights(phase, horizon), -mpc.divergent.offset_row(phase), [1.0]])
        variables = np.concatenate([u, part["state"], part["tail"]])
    prog.AddLinearEqualityConstraint(row[None], [0.0], variables)

    slacks = []
    for barrier in barriers:
        coefficients = barrier.sign * psi_coefficients(linear_rates(barrier))
        # Rows at the start that no input affects are left out, as in our program.
        first = int(np.argmax(affine_rows(barrier, vhip.system, phase, horizon).reachable))
        count = horizon + 2 - len(coefficients) - first
        slack = prog.NewContinuousVariables(count if soft else 0, "slack")
        slacks.append(slack)
        bound = part[f"bound_{barrier.name}"]
        for i in range(count):
            window = slice(first + i, first + i + len(coefficients))
            normals = barrier.normals(phase + first + i, len(coefficients))
            on_path = (-coefficients[:, None] * normals).ravel()
            rows = np.concatenate([on_path, coefficients, [1.0] * soft])
            variables = np.concatenate([path[window].ravel(), bound[window], slack[i : i + 1]])
            prog.AddLinearConstraint(rows[None], [0.0], [np.inf], variables)
        if soft:
            linear, quadratic = config.slack_weight
            prog.AddQuadraticCost(2.0 * quadratic * np.eye(count), np.full(count, linear), slack)
            prog.AddBoundingBoxConstraint(0.0, np.inf, slack)
    return compile_program(prog, np.concatenate([u, f, *slacks, states]), theta)
