"""The programs of problem (36) for every phase of the step, compiled, each with its solver, and kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from pdhocbf_drake.kept import Kept
from pdhocbf_drake.mpc.axis_problem import AxisProblem
from pdhocbf_drake.mpc.digest import digest
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
