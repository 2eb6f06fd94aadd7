"""Survival over the factors of a campaign: intervals, curves, and maps."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from pdhocbf_drake.analysis.drawing import styled
from pdhocbf_drake.analysis.figures import Drawn
from pdhocbf_drake.analysis.palette import SAFE, UNSAFE, case_colour
from pdhocbf_drake.studies.campaign.config import CampaignConfig
from pdhocbf_drake.studies.campaign.store import FAILED
from pdhocbf_drake.studies.campaign.survival import Row, survival_rate
from pdhocbf_drake.studies.shared.endings import SURVIVED

_BINS = 6  # bins on each axis of a curve or map where values are drawn at random
_MOST_VALUES = 12  # up to this number each given value has its own bin
_MOST_FACTORS = 3  # number of factors that are drawn against each other unless a campaign names the maps
_NO_RUNS = "#E4E4E4"  # the colour of a cell without runs
_RATES = LinearSegmentedColormap.from_list("survival", [UNSAFE, "#F5EBC0", SAFE])


def make_figures(config: CampaignConfig, rows: Sequence[Row]) -> list[Drawn]:
    """The figures of the report; rows of failed runs are left out."""
    rows = [row for row in rows if row["status"] != FAILED]
    numbers = numeric_factors(config, rows)
    pairs = config.maps if config.maps is not None else tuple(combinations(numbers[:_MOST_FACTORS], 2))
    with styled():
        drawn = [Drawn("survival", "Share of runs that survive, with 95 % Wilson intervals", _intervals(config, rows))]
        if numbers:
            caption = "Survival over each factor, in bins, with 95 % Wilson intervals"
            drawn.append(Drawn("curves", caption, _curves(config, rows, numbers)))
        for number, (first, second) in enumerate(pairs):
            if {first, second} <= set(numbers):
                caption = f"Survival over {first} and {second}: shaded by the rate in each cell, o survived, x fell"
                drawn.append(Drawn(f"map_{number}", caption, _map(config, rows, first, second)))
    return drawn


def numeric_factors(config: CampaignConfig, rows: Sequence[Row]) -> list[str]:
    """Factors that are numbers and take more than one value."""
    taken = {path: {row[path] for row in rows if row.get(path) is not None} for path in config.factors}
    return [path for path, values in taken.items() if len(values) > 1 and all(isinstance(v, float) for v in values)]


def _intervals(config: CampaignConfig, rows: Sequence[Row]) -> Figure:
    figure = Figure(figsize=(8.5, 0.9 + 0.45 * len(config.barriers)))
    axes = figure.subplots()
    for place, name in enumerate(config.barriers):
        rate, low, high, n = survival_rate(row for row in rows if row["barrier"] == name)
        if rate is None or low is None or high is None:
            continue
        error = [[rate - low], [high - rate]]
        axes.errorbar([rate], [place], xerr=error, fmt="o", color=case_colour(name, place), capsize=4)
        axes.annotate(f"n = {n}", (1.02, place), va="center", annotation_clip=False)
    axes.set(xlim=(0, 1), ylim=(len(config.barriers) - 0.5, -0.5), xlabel="survival rate [1]")
    axes.set_yticks(range(len(config.barriers)), list(config.barriers))
    return figure


def _curves(config: CampaignConfig, rows: Sequence[Row], factors: Sequence[str]) -> Figure:
    figure = Figure(figsize=(8.5, 2.4 * len(factors) + 0.3))
    panels = figure.subplots(len(factors), 1, squeeze=False)[:, 0]
    for axes, path in zip(panels, factors, strict=True):
        edges = _edges(config, rows, path)
        for place, name in enumerate(config.barriers):
            mine = [row for row in rows if row["barrier"] == name and row.get(path) is not None]
            cells = [[row for row, at in zip(mine, _cells(mine, path, edges), strict=True) if at == i]
                     for i in range(len(edges) - 1)]  # fmt: skip
            rates = [(edges[i : i + 2].mean(), survival_rate(cell)) for i, cell in enumerate(cells) if cell]
            if not rates:
                continue
            # Side by side, so that intervals don't hide each other.
            shift = (place - (len(config.barriers) - 1) / 2) * 0.08 * (edges[1] - edges[0])
            x = np.array([centre for centre, _ in rates]) + shift
            rate, low, high = np.array([found[:3] for _, found in rates], dtype=float).T
            bars = [rate - low, high - rate]
            colour = case_colour(name, place)
            axes.errorbar(x, rate, yerr=bars, fmt="o-", markersize=4, capsize=2, color=colour, label=name)
        axes.set(ylim=(-0.05, 1.05), xlabel=_label(config, path), ylabel="survival rate [1]")
    panels[0].legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=4)
    return figure


def _map(config: CampaignConfig, rows: Sequence[Row], first: str, second: str) -> Figure:
    count = len(config.barriers)
    columns = min(3, count)
    lines = -(-count // columns)
    figure = Figure(figsize=(9.0, 3.1 * lines + 0.6))
    grid = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True).ravel()
    edges = _edges(config, rows, first), _edges(config, rows, second)
    shade = None
    for axes, name in zip(grid, config.barriers, strict=False):
        mine = [r for r in rows if r["barrier"] == name and r.get(first) is not None and r.get(second) is not None]
        shade = axes.pcolormesh(*edges, _rates(mine, first, second, edges).T, cmap=_RATES, vmin=0, vmax=1, alpha=0.55)
        _marks(axes, mine, first, second)
        axes.set_title(f"{name} ({sum(row['status'] == SURVIVED for row in mine)} of {len(mine)})")
        axes.grid(False)
        axes.set_facecolor(_NO_RUNS)
    for axes in grid[count:]:
        axes.set_axis_off()
    figure.supxlabel(_label(config, first), fontsize=10)
    figure.supylabel(_label(config, second), fontsize=10)
    if shade is not None:
        figure.colorbar(shade, ax=list(grid), label="survival rate [1]", shrink=0.9)
    return figure


def _marks(axes: Axes, rows: Sequence[Row], first: str, second: str) -> None:
    for survived, colour, marker in ((True, SAFE, "o"), (False, UNSAFE, "x")):
        chosen = [row for row in rows if (row["status"] == SURVIVED) == survived]
        points = [row[first] for row in chosen], [row[second] for row in chosen]
        axes.scatter(*points, s=16, c=colour, marker=marker, clip_on=False, zorder=3)


def _rates(rows: Sequence[Row], first: str, second: str, edges: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Share of survivors in each cell, shape (n_first, n_second); NaN in a cell without runs."""
    cells = _cells(rows, first, edges[0]), _cells(rows, second, edges[1])
    total = np.zeros((len(edges[0]) - 1, len(edges[1]) - 1))
    survived = np.zeros_like(total)
    np.add.at(total, cells, 1)
    np.add.at(survived, cells, [row["status"] == SURVIVED for row in rows])
    return np.divide(survived, total, out=np.full_like(total, np.nan), where=total > 0)


def _edges(config: CampaignConfig, rows: Sequence[Row], path: str) -> np.ndarray:
    """Bins of equal width, or one for each of a few given values."""
    factor = config.factors[path]
    values = np.unique([row[path] for row in rows if row.get(path) is not None])
    given = factor.values is not None or config.sample == "grid"
    if given and 1 < len(values) <= _MOST_VALUES:
        middle = (values[1:] + values[:-1]) / 2
        return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])
    low = values[0] if factor.low is None else factor.low
    high = values[-1] if factor.high is None else factor.high
    return (np.geomspace if factor.scale == "log" else np.linspace)(low, high, _BINS + 1)


def _cells(rows: Sequence[Row], path: str, edges: np.ndarray) -> np.ndarray:
    """The index of each row's bin; values beyond the ends are in the first and the last one."""
    values = np.array([row[path] for row in rows], dtype=float)
    return np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)


def _label(config: CampaignConfig, path: str) -> str:
    return f"{path} [{config.factors[path].unit}]"
