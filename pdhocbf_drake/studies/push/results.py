"""The impulses that the robot survived: `push.json`, their medians, a table and two figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pdhocbf_drake import terminal
from pdhocbf_drake.analysis.drawing import save, styled
from pdhocbf_drake.analysis.palette import LIMIT, case_colour
from pdhocbf_drake.studies.shared.events import DIRECTIONS
from pdhocbf_drake.studies.shared.push_search import Impulse

UNIT = "N s"


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
    rows = [
        (way, barrier, middle[barrier][way], *(survived.get((barrier, way, phase)) for phase in phases))
        for way in dict.fromkeys(impulse.direction for impulse in impulses)
        for barrier in dict.fromkeys(impulse.barrier for impulse in impulses)
    ]
    at = [f"at tick {phase}" if phase == phases[0] else str(phase) for phase in phases]
    return terminal.table(rows, (f"survived [{UNIT}]", "barrier", "median", *at))


def draw_polar(impulses: Sequence[Impulse], path: Path) -> None:
    """Draws the median over the phases (line) and each phase (dots) per direction, in the view from above."""
    with styled():
        figure = Figure(figsize=(6.0, 6.0))
        axes = figure.add_subplot(projection="polar")
        axes.set_theta_zero_location("N")  # type: ignore[attr-defined]
        middle = medians(impulses)
        for number, (barrier, by_way) in enumerate(middle.items()):
            colour = case_colour(barrier, number)
            ways = sorted(by_way, key=DIRECTIONS.__getitem__)
            ring = [*ways, ways[0]] if len(ways) > 2 else ways
            angles = np.radians([DIRECTIONS[way] for way in ring])
            axes.plot(angles, [by_way[way] for way in ring], color=colour, label=barrier)
            dots = [(np.radians(DIRECTIONS[i.direction]), i.survived) for i in impulses if i.barrier == barrier]
            # Side by side, so that equal results of different barriers don't hide each other.
            shift = 0.035 * (number - (len(middle) - 1) / 2)
            axes.plot([a + shift for a, _ in dots], [s for _, s in dots], ".", color=colour, alpha=0.5)
        axes.set_xticks(np.radians(list(DIRECTIONS.values())), ["ahead +x", "left +y", "back -x", "right -y"])
        axes.set_title(f"largest survived impulse [{UNIT}]: median (line), phases (dots)", pad=24)
        axes.legend(loc="lower left", bbox_to_anchor=(-0.1, -0.12), ncols=3)
        save(figure, path)


def draw_phases(impulses: Sequence[Impulse], path: Path, ticks_per_step: int) -> None:
    """Draws the survived impulse over the tick of the gait at which the push begins, one panel a direction."""
    ways = list(dict.fromkeys(impulse.direction for impulse in impulses))
    with styled():
        figure = Figure(figsize=(8.5, 1.9 * len(ways) + 0.8))
        panels = figure.subplots(len(ways), 1, sharex=True, squeeze=False)[:, 0]
        for axes, way in zip(panels, ways, strict=True):
            for number, barrier in enumerate(dict.fromkeys(impulse.barrier for impulse in impulses)):
                points = sorted((i.phase, i.survived) for i in impulses if (i.barrier, i.direction) == (barrier, way))
                style = ("-", "--", ":")[number % 3]
                colour = case_colour(barrier, number)
                axes.plot(*zip(*points, strict=True), marker="o", ls=style, color=colour, label=barrier)
            axes.axvline(ticks_per_step, color=LIMIT, lw=0.8)
            axes.set_ylim(0.0, 1.1 * max(1.0, *(i.survived for i in impulses if i.direction == way)))
            axes.set_ylabel(f"{way} [{UNIT}]")
        panels[0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
        panels[-1].set_xlabel("tick of the gait at which the push begins [1]; the line parts its two steps")
        save(figure, path)
