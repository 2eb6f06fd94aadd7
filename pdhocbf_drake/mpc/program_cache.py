"""Compiled programs that several controllers have in common, so that each is compiled once."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, NamedTuple

from pdhocbf_drake.mpc.compiled import ParametricQp
from pdhocbf_drake.mpc.solvers import QpSolver


class Compiled(NamedTuple):
    """One axis: a program and its solver for each phase of the step."""

    qps: list[ParametricQp]
    solvers: list[QpSolver]


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
