"""The programs of problem (36) for every phase of the step, compiled, each with its solver; and the ladder below them.

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
from typing import Generic, NamedTuple, TypeVar

from pdhocbf_drake.kept import Kept
from pdhocbf_drake.mpc.axis_problem import AxisProblem
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.mpc.terms.term import Term
from pdhocbf_drake.qp import ParametricQp, QpSolver, make_solver

T = TypeVar("T")


class OnDemand(Sequence[T], Generic[T]):
    """A sequence whose entries are made when they are first asked for, and then kept."""

    def __init__(self, count: int, make: Callable[[int], T]) -> None:
        self._make, self._kept = make, dict[int, T]()
        self._count = count

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> T:  # type: ignore[override]
        if not -self._count <= index < self._count:
            raise IndexError(index)
        place = index % self._count
        if place not in self._kept:
            self._kept[place] = self._make(place)
        return self._kept[place]


class Compiled(NamedTuple):
    """One axis: a program and its solver for each phase of the step."""

    qps: Sequence[ParametricQp]
    solvers: Sequence[QpSolver]


class ProgramCache:
    """Compiled programs that several controllers have in common, by what they were made from (`AxisProblem.key`).

    Without a barrier the axes x and y differ in their parameters alone, and so do a walk and its nominal orbit: they
    share programs and solvers, which carry nothing from one solve to the next that would change an answer.
    """

    def __init__(self, most: int | None = None) -> None:
        """Keeps the programs of the last `most` axes; None keeps all."""
        self._kept = Kept[Compiled](most)

    def compiled(self, problem: AxisProblem) -> Compiled:
        """The programs of one axis, each compiled when it is first asked for."""
        return self._kept.get(problem.key, lambda: _compiled(problem))


def _compiled(problem: AxisProblem) -> Compiled:
    count, solver = problem.setting.gait.period, problem.setting.config.solver
    qps = OnDemand(count, problem.compile)
    solvers = OnDemand(
        count, lambda phase: make_solver(solver, qps[phase], problem.bound_rows, problem.guess_rows(qps, phase))
    )
    return Compiled(qps, solvers)


class Rung:
    """One variant of the problem on both axes, compiled per phase when it is first needed.

    Attributes:
        reason: what a plan from this rung is logged with.
    """

    def __init__(self, reason: Reason, problems: Sequence[AxisProblem], solver: str) -> None:
        self.reason = reason
        self._problems, self._solver = problems, solver
        self._solvers: dict[tuple[int, int], QpSolver] = {}

    def solver(self, axis: int, phase: int) -> QpSolver:
        """The solver of this problem."""
        if (axis, phase) not in self._solvers:
            problem = self._problems[axis]
            self._solvers[axis, phase] = make_solver(self._solver, problem.compile(phase), problem.bound_rows)
        return self._solvers[axis, phase]


def rungs_of(problems: Sequence[AxisProblem]) -> list[Rung]:
    """What is solved where the scenario's own problem has no solution."""
    config = problems[0].setting.config
    own = Rung(Reason.CROSS_SOLVED, problems, "clarabel")
    hard = config.barrier == "hard" and any(problem.setting.barriers for problem in problems)
    softened = [Rung(Reason.SOFTENED, _changed(problems, Term.softened), config.solver)] if hard else []
    return [own, *softened, Rung(Reason.RELAXED, _changed(problems, Term.relaxed), config.solver)]


def _changed(problems: Sequence[AxisProblem], change: Callable[[Term], Term]) -> list[AxisProblem]:
    return [problem.changed(lambda term: getattr(term, change.__name__)()) for problem in problems]
