"""Rows of a table of what walks must reach: what is asked of them, their kinds, and the table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.checks import check_straight
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.checks import Check, Outcome, combined


class Asked(NamedTuple):
    """What is asked of a table.

    Attributes:
        scenario: the walk that is studied, as JSON.
        quick: whether a short version is wanted.
        numbers: the study's numbers by name.
        prepared: what `Table.prepare` made of the scenario.
    """

    scenario: str
    quick: bool
    numbers: Mapping[str, int]
    prepared: Any = None


class Kind(Protocol):
    """A kind of rows, usually a module: the pieces of work of a row, and what measures a piece.

    A piece has the name of its row as `row`. `measure` may run in another process: it and the pieces are pickled.
    """

    def plan(self, row: str, asked: Asked, /) -> Sequence[Any]:
        """The pieces of work of a row; raises `InputError`."""

    def measure(self, work: Any, /) -> Outcome:
        """Does one piece of work."""


@dataclass(frozen=True)
class Table:
    """The rows of a study, and how their measurements come together.

    Attributes:
        kinds: the kind of each row by the row's name, in the order of the table.
        unless_quick: rows that a quick table has where they are named alone.
        always: rows that are walked beside any others.
        flat, stride: whether the scenario must be on flat ground, and walk ahead.
        prepare: what all rows need of the scenario; `Asked.prepared`.
        order: of the work, as a key for sorting; None is that of the table.
        together: the checks of the table, from those of all pieces; None puts them in the order of the rows.
    """

    kinds: Mapping[str, Kind]
    unless_quick: Sequence[str] = ()
    always: Sequence[str] = ()
    flat: bool = False
    stride: bool = False
    prepare: Callable[[Scenario], Any] = lambda scenario: None
    order: Callable[[Any], Any] | None = None
    together: Callable[[Iterable[Check]], list[Check]] | None = None

    def check(self, scenario: Scenario) -> None:
        """Raises `InputError` for a scenario that is no walk of a robot as the table needs it."""
        where, keys = "", ["system: biped", "gait.walk_steps: null"]
        if self.flat:
            where, keys = "on flat ground ", [*keys, "ground: []"]
        if self.stride:
            keys.append("a gait.stride")
        unfit = self.flat and scenario.ground, self.stride and not scenario.gait.stride
        if scenario.system != "biped" or scenario.gait.walk_steps is not None or any(unfit):
            needed = f"a walk of a robot {where}without an end is needed ({', '.join(keys)})"
            raise InputError(f"scenario '{scenario.name}': {needed}")
        check_straight(scenario)

    def in_order(self, checks: Iterable[Check]) -> list[Check]:
        """One check for each row and what is measured of it, in the order of the rows."""
        rows = list(self.kinds)
        return combined(sorted(checks, key=lambda check: rows.index(check.row)))


def entry(row: str) -> str:
    """The name of a row's run folder."""
    return row.replace(" ", "_")
