"""The ladder: what is solved where a program of problem (36) has no solution.

1. own        what the scenario asks for; solved once more by the independent solver where the first one gives up.
2. softened   only below a hard barrier: its rows get slacks with an exact price.
3. relaxed    stability row (or terminal set) paid for instead of demanded, barriers soft and without decay (γ = 1), no
              bound on the ZMP's velocity. Only ZMP boxes and step limits are left; where these contradict each other,
              no rung has a solution (`Reason.INFEASIBLE`). With `mpc.recovery` the walk is planned as a disturbed one
              instead (`Reason.NO_STEADY_PLAN`).

Below them the controller shifts its last plan; and a walk that stays degraded comes to a stand.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pdhocbf_drake.mpc.axis_problem import AxisProblem
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.mpc.programs import OnDemand
from pdhocbf_drake.mpc.terms.term import Term
from pdhocbf_drake.qp import ParametricQp, QpResult, QpSolver, make_solver


class Rung:
    """One variant of the problem on both axes, compiled per phase when it is first needed.

    Attributes:
        reason: what a plan from this rung is logged with.
    """

    def __init__(
        self,
        reason: Reason,
        problems: Sequence[AxisProblem],
        solver: str,
        qps: Sequence[Sequence[ParametricQp]] | None = None,
    ) -> None:
        """
        Args:
            problems: of both axes. solver: the solver's name.
            qps: their programs by axis and phase, where others have them too.
        """
        self.reason = reason
        self._problems, self._solver = problems, solver
        self._qps = qps or [OnDemand(problem.period, problem.compile) for problem in problems]
        self._solvers: dict[tuple[int, int], QpSolver] = {}

    def solver(self, axis: int, tick: int) -> QpSolver:
        """The solver of this problem at tick k."""
        qps = self._qps[axis]
        place = axis, tick % len(qps)
        if place not in self._solvers:
            problem = self._problems[axis]
            self._solvers[place] = make_solver(self._solver, qps[place[1]], problem.bound_rows)
        return self._solvers[place]


def rungs_of(problems: Sequence[AxisProblem], qps: Sequence[Sequence[ParametricQp]]) -> list[Rung]:
    """What is solved where the scenario's own problem, with these programs, has no solution."""
    config = problems[0].setting.config
    own = Rung(Reason.CROSS_SOLVED, problems, "clarabel", qps)
    hard = config.barrier == "hard" and any(problem.setting.barriers for problem in problems)
    softened = [Rung(Reason.SOFTENED, _changed(problems, Term.softened), config.solver)] if hard else []
    return [own, *softened, Rung(Reason.RELAXED, _changed(problems, Term.relaxed), config.solver)]


def descended(
    rungs: Sequence[Rung], recovers: bool, axis: int, tick: int, theta: np.ndarray, result: QpResult
) -> tuple[QpResult, Reason]:
    """The result of the first rung that has a solution, and the reason to log for it.

    Args:
        rungs: from the scenario's own problem down.
        recovers: whether a walk that would miss its tail is planned as a disturbed one instead.
        axis, tick, theta: of the program that has no solution.
        result: what its solver answered.
    """
    for rung in rungs:
        if rung.reason == Reason.CROSS_SOLVED and result.infeasible:
            continue  # it has been proved that there is no solution
        if rung.reason == Reason.RELAXED and result.infeasible and recovers:
            return result, Reason.NO_STEADY_PLAN  # rather than a steady walk that misses its tail
        result = rung.solver(axis, tick).solve(theta)
        if result.ok:
            return result, rung.reason
    return result, Reason.INFEASIBLE if result.infeasible else Reason.NOT_OPTIMAL


def _changed(problems: Sequence[AxisProblem], change: Callable[[Term], Term]) -> list[AxisProblem]:
    return [problem.changed(lambda term: getattr(term, change.__name__)()) for problem in problems]
