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

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from pdhocbf_drake.kept import Kept
from pdhocbf_drake.mpc.axis_problem import AxisProblem
from pdhocbf_drake.mpc.digest import digest
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.mpc.terms.term import Term
from pdhocbf_drake.qp import DaqpQp, ParametricQp, QpSolver, make_solver

T = TypeVar("T")

PARTS = ("sizes", "reals", "integers", "places", "hessian", "rows")
"""The names of `DaqpQp.constants`."""


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

    @property
    def is_complete(self) -> bool:
        """Whether all of them have been made."""
        return len(self._kept) == self._count


class Compiled(NamedTuple):
    """One axis: a program and its solver for each tick of the step, and how many rows the program has.

    For each tick of the gait where its two steps differ.
    """

    qps: Sequence[ParametricQp]
    solvers: Sequence[QpSolver]
    rows: Sequence[int]


class ProgramCache:
    """Compiled programs that several controllers have in common, by what they were made from (`AxisProblem.key`).

    Without a barrier the axes x and y differ in their parameters alone, and so do a walk and its nominal orbit: they
    share programs and solvers, which carry nothing from one solve to the next that would change an answer.

    Attributes:
        kept: arrays of earlier processes, by name, which spare compiling.
    """

    def __init__(self, kept: Mapping[str, np.ndarray] | None = None, most: int | None = None) -> None:
        """Keeps the programs of the last `most` axes; None keeps all."""
        self.kept: Mapping[str, np.ndarray] = kept or {}
        self._new: dict[str, np.ndarray] = {}
        self._compiled = Kept[tuple[str | None, Compiled]](most)

    def compiled(self, problem: AxisProblem) -> Compiled:
        """The programs of one axis, each compiled when it is first asked for."""

        def make() -> tuple[str | None, Compiled]:
            name = digest(problem.key)
            return name, _compiled(problem, None if name is None else self._programs(name))

        return self._compiled.get(problem.key, make)[1]

    def __contains__(self, name: str) -> bool:
        """Whether there is a kept array of that name."""
        return name in self.kept or name in self._new

    def array(self, name: str, make: Callable[[], np.ndarray]) -> np.ndarray:
        """An array that takes long to make, once for all processes."""
        if name not in self:
            self._new[name] = make()
        return self._new[name] if name in self._new else self.kept[name]

    def new(self) -> dict[str, np.ndarray]:
        """What this process has made and is worth keeping: of the solvers, those of whom every phase has been made."""
        return self._new | {
            f"{name}/{phase}/{part}": array
            for name, axis in self._compiled
            if name is not None
            and not self._programs(name)
            and isinstance(axis.solvers, OnDemand)
            and axis.solvers.is_complete
            for phase, solver in enumerate(axis.solvers)
            if isinstance(solver, DaqpQp)
            for part, array in (solver.constants() or {}).items()
        }

    def _programs(self, name: str) -> list[Mapping[str, np.ndarray]]:
        """The kept constants of the solvers with that name, by phase."""
        phase = 0
        while all(f"{name}/{phase}/{part}" in self.kept for part in PARTS):
            phase += 1
        return [_Constants(self.kept, f"{name}/{i}/") for i in range(phase)]


class _Constants(Mapping[str, np.ndarray]):
    """The constants of one solver among many arrays."""

    def __init__(self, kept: Mapping[str, np.ndarray], start: str) -> None:
        self._kept, self._start = kept, start

    def __len__(self) -> int:
        return len(PARTS)

    def __iter__(self) -> Iterator[str]:
        return iter(PARTS)

    def __getitem__(self, part: str) -> np.ndarray:
        return self._kept[self._start + part]


def _compiled(problem: AxisProblem, kept: Sequence[Mapping[str, np.ndarray]] | None) -> Compiled:
    """The programs of one axis, whose solvers are made from what is kept, if there is anything."""
    count, name = problem.period, problem.setting.config.solver
    qps = OnDemand(count, problem.compile)

    def source(phase: int) -> tuple[ParametricQp, Sequence[str], np.ndarray]:
        return qps[phase], problem.bound_rows, problem.guess_rows(qps, phase)

    def solver(phase: int) -> QpSolver:
        found = DaqpQp.of_constants(kept[phase], lambda: source(phase)) if kept and len(kept) == count else None
        return found or make_solver(name, *source(phase))

    if kept and len(kept) == count:
        return Compiled(qps, OnDemand(count, solver), [int(constants["sizes"][0]) for constants in kept])
    return Compiled(qps, OnDemand(count, solver), OnDemand(count, lambda phase: len(qps[phase].A)))


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


def _changed(problems: Sequence[AxisProblem], change: Callable[[Term], Term]) -> list[AxisProblem]:
    return [problem.changed(lambda term: getattr(term, change.__name__)()) for problem in problems]
