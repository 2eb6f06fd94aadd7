"""The ladder's rungs: problem (36) as the scenario asks for it, then with less and less demanded.

1. own        what the scenario asks for; solved once more by the independent solver where the first one gives up.
2. softened   only below a hard barrier: its rows get slacks with an exact price.
3. relaxed    stability row (or terminal set) paid for instead of demanded, barriers soft and without decay (γ = 1).
              Only ZMP boxes and step limits are left; where these contradict each other, no rung has a solution
              (`Reason.INFEASIBLE`). With `mpc.recovery` the walk is planned as a disturbed one instead
              (`Reason.NO_STEADY_PLAN`).

Below them the controller shifts its last plan; and a walk that stays degraded comes to a stand.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pdhocbf_drake.barriers import AffineBarrier, Linear
from pdhocbf_drake.mpc.axis_program import BOUND_ROWS
from pdhocbf_drake.mpc.solution import Reason
from pdhocbf_drake.qp import ParametricQp, QpSolver, make_solver


class Rung:
    """One variant of the problem, compiled per axis and phase when it is first needed.

    Attributes:
        reason: what a plan from this rung is logged with.
    """

    def __init__(self, reason: Reason, compile_axis: Callable[[int, int], ParametricQp], solver: str) -> None:
        self.reason = reason
        self._compile, self._solver = compile_axis, solver
        self._solvers: dict[tuple[int, int], QpSolver] = {}

    def solver(self, axis: int, phase: int) -> QpSolver:
        """The solver of this problem."""
        if (axis, phase) not in self._solvers:
            self._solvers[axis, phase] = make_solver(self._solver, self._compile(axis, phase), BOUND_ROWS)
        return self._solvers[axis, phase]


def without_decay(barriers: Sequence[AffineBarrier]) -> list[AffineBarrier]:
    """The same barriers with γ = 1 throughout: ψ_m ≥ 0 then says no more than h(k + m) ≥ 0."""
    return [
        AffineBarrier(b.name, b.normal, b.bound, b.sign, [Linear(1.0)] * b.order, b.unit, b.relative_degree)
        for b in barriers
    ]
