"""Compiled programs that several controllers have in common, so that each is compiled once."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

from pdhocbf_drake.qp import ParametricQp, QpSolver

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
    """What has been compiled, by what it was made from.

    Without a barrier the axes x and y differ in their parameters alone, and so do a walk and its nominal orbit: they
    share programs and solvers, which carry nothing from one solve to the next that would change an answer.
    """

    def __init__(self) -> None:
        self._kept: dict[Hashable, tuple[Compiled, Any]] = {}

    def get(self, key: Hashable, alive: Any, make: Callable[[], Compiled]) -> Compiled:
        """What was made for this key, or is made now; `alive` is what the key only knows by its id."""
        if key not in self._kept:
            self._kept[key] = (make(), alive)
        return self._kept[key][0]
