"""The rows of `pdhocbf worth`, each of one event under one barrier; their medians as a table, and a figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pdhocbf_drake import terminal
from pdhocbf_drake.analysis.drawing import save, styled
from pdhocbf_drake.analysis.palette import CASES as COLOURS
from pdhocbf_drake.studies.shared.cases import CASES, NONE


class Measures(NamedTuple):
    """One event under one barrier; times are counted from the event, and NaN means never.

    Attributes:
        plant, barrier, gamma, event, phase: the experiment; gamma is NaN without a barrier, phase a tick.
        notices, acts, recovers: as in `shared.measures.Outcome` [s].
        excess: as there [m/s].
        steps: `recovers` in steps, rounded up.
        work: positive mechanical work: of the horizontal force along the bounded axes on the template [J/kg], of the
            joints on the robot [J].
        survived: whether the walk went on.
    """

    plant: str
    barrier: str
    gamma: float
    event: str
    phase: int
    notices: float
    acts: float
    excess: float
    recovers: float
    steps: float
    work: float
    survived: bool


# Columns of the table: field, factor.
_COLUMNS: Final = {
    "notices [ms]": ("notices", 1e3),
    "acts [ms]": ("acts", 1e3),
    "excess [mm/s]": ("excess", 1e3),
    "recovers [s]": ("recovers", 1.0),
    "steps": ("steps", 1.0),
    "work": ("work", 1.0),
}
# Fields in the figure: name, unit, factor.
_DRAWN: Final = {
    "excess": ("largest excess", "mm/s", 1e3),
    "recovers": ("recovery time", "s", 1.0),
    "acts": ("acts after", "ms", 1e3),
}


def table(rows: Sequence[Measures]) -> str:
    """One line per event, barrier and γ: medians over the phases, "–" where the median phase has none."""
    groups: dict[tuple[str, str, float], list[Measures]] = {}
    for row in rows:
        key = (row.event, row.barrier, -1.0 if math.isnan(row.gamma) else row.gamma)
        groups.setdefault(key, []).append(row)
    lines = []
    for (event, barrier, gamma), group in groups.items():
        cells = [_median(group, name, scale) for name, scale in _COLUMNS.values()]
        rate, noticed = "–", "–"
        if gamma >= 0:
            rate, noticed = f"{gamma:g}", f"{sum(not math.isnan(row.notices) for row in group)}/{len(group)}"
        lines.append((event, barrier, rate, noticed, *cells, f"{sum(row.survived for row in group)}/{len(group)}"))
    return terminal.table(lines, ("event", "barrier", "γ", "noticed", *_COLUMNS, "walked on"))


def _median(group: Sequence[Measures], name: str, scale: float) -> str:
    values = np.array([getattr(row, name) for row in group])
    # Never comes after every time.
    middle = float(np.median(np.where(np.isnan(values), np.inf, values)))
    return f"{middle * scale:.3g}" if math.isfinite(middle) else "–"


def draw(rows: Sequence[Measures], path: Path) -> None:
    """Draws each measure over γ, one column an event: median over the phases as a line, each phase as a dot."""
    events = list(dict.fromkeys(row.event for row in rows))
    with styled():
        figure = Figure(figsize=(3.4 * len(events) + 0.6, 2.3 * len(_DRAWN) + 0.6))
        grid = figure.subplots(len(_DRAWN), len(events), squeeze=False, sharex=True)
        for panels, (name, (what, unit, scale)) in zip(grid, _DRAWN.items(), strict=True):
            panels[0].set_ylabel(f"{what} [{unit}]")
            for axes, event in zip(panels, events, strict=True):
                for case in CASES:
                    here = [row for row in rows if (row.event, row.barrier) == (event, case)]
                    values = [(row.gamma, getattr(row, name) * scale) for row in here]
                    if values and (name != "acts" or case != NONE):
                        _draw_case(axes, values, case)
                axes.set_xscale("log")
        for axes, event in zip(grid[0], events, strict=True):
            axes.set_title(event)
        for axes in grid[-1]:
            axes.set_xlabel("γ [1]")
        grid[0][0].legend()
        save(figure, path)


def _draw_case(axes: Axes, values: Sequence[tuple[float, float]], case: str) -> None:
    """One case's median over the phases, and its phases as dots; NaN is left out."""
    if case == NONE:
        finite = [value for _, value in values if value == value]
        if finite:
            axes.axhline(float(np.median(finite)), color=COLOURS[case], ls="--", label=case)
        return
    gammas = sorted({gamma for gamma, _ in values})
    groups = [[v for g, v in values if g == gamma and v == v] for gamma in gammas]
    middle = [float(np.median(group)) if group else np.nan for group in groups]
    axes.plot(gammas, middle, color=COLOURS[case], marker="o", label=case)
    for gamma, group in zip(gammas, groups, strict=True):
        axes.plot([gamma] * len(group), group, ".", color=COLOURS[case], alpha=0.3)
