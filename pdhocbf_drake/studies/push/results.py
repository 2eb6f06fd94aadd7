"""What the robot survived: `push.json`, its medians, and a table to read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from statistics import median
from typing import Any, NamedTuple

UNIT = "N s"


class Impulse(NamedTuple):
    """The largest survived impulse [N s] in one direction, from one tick of the gait on, under one barrier."""

    barrier: str
    direction: str
    phase: int
    survived: float


def medians(impulses: Iterable[Impulse]) -> dict[str, dict[str, float]]:
    """Median over the phases, by barrier and direction [N s]."""
    groups: dict[str, dict[str, list[float]]] = {}
    for impulse in impulses:
        groups.setdefault(impulse.barrier, {}).setdefault(impulse.direction, []).append(impulse.survived)
    return {barrier: {way: median(values) for way, values in ways.items()} for barrier, ways in groups.items()}


def document(impulses: Sequence[Impulse]) -> dict[str, Any]:
    """The contents of `push.json`."""
    return {"impulse": [{**impulse._asdict(), "unit": UNIT} for impulse in impulses], "median": medians(impulses)}


def table(impulses: Sequence[Impulse]) -> str:
    """One line per direction and barrier: the median, then every phase [N s]."""
    phases = sorted({impulse.phase for impulse in impulses})
    survived = {(i.barrier, i.direction, i.phase): i.survived for i in impulses}
    middle = medians(impulses)
    barriers = list(dict.fromkeys(impulse.barrier for impulse in impulses))
    lines = [f"survived [{UNIT}]    median   at tick " + "".join(f"{phase:6d}" for phase in phases)]
    for direction in dict.fromkeys(impulse.direction for impulse in impulses):
        for barrier in barriers:
            values = [survived.get((barrier, direction, phase)) for phase in phases]
            row = "".join("     -" if value is None else f"{value:6.1f}" for value in values)
            lines.append(f"{direction:3} {barrier:9} {middle[barrier][direction]:12.1f}           {row}")
    return "\n".join(lines)
