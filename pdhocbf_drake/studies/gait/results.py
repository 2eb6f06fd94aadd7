"""Measured gaits as `gait.json`, as a table, and as figures: a line for each parameter, a map over two of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pdhocbf_drake.analysis.drawing import save, styled
from pdhocbf_drake.files.file import replaced_file
from pdhocbf_drake.files.pages import page
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.gait_measures import GaitMeasures
from pdhocbf_drake.studies.shared.gait_table import quantities

LINES, MAP = "gait_lines.png", "gait_map.png"
_UNITS = {"com_height": "m", "com_height_amplitude": "m"}


def document(scenario: Scenario, gaits: Sequence[GaitMeasures]) -> dict[str, Any]:
    """The contents of `gait.json`."""
    units = {
        "torque": "N m",
        "speed": "m/s",
        "joint_speed": "rad/s",
        "zmp_inside": "m",
        "zmp_beyond": "m",
        "zmp_margin": "m",
        "push": "N s",
        "certified_area": "m²/s",
    }
    own = {key: getattr(scenario.gait, key) for key in _keys(gaits)}
    return {"scenario": scenario.name, "own": own, "units": units, "gaits": [gait._asdict() for gait in gaits]}


def write_figures(gaits: Sequence[GaitMeasures], folder: Path) -> None:
    """`gait_lines.png` of the gaits with one varied parameter, `gait_map.png` of those with two.

    Warns of one that can't be drawn (`PageWarning`).
    """
    single = [gait for gait in gaits if len(gait.values) == 1]
    double = [gait for gait in gaits if len(gait.values) == 2]
    for name, chosen, draw in ((LINES, single, _lines), (MAP, double, _maps)):
        if chosen:
            with page(name), replaced_file(folder / name) as staging:
                draw(chosen, staging)


def _lines(gaits: Sequence[GaitMeasures], path: Path) -> None:
    """A column for each parameter, a row for each quantity; a gait that does not walk leaves a gap."""
    keys, rows = _keys(gaits), quantities(gaits)
    with styled():
        figure = Figure(figsize=(2.6 * len(keys) + 1.0, 1.5 * len(rows) + 0.6))
        panels = figure.subplots(len(rows), len(keys), sharex="col", sharey="row", squeeze=False)
        for column, key in enumerate(keys):
            own = sorted((g for g in gaits if key in g.values), key=lambda g: float(g.values[key]))
            for row, quantity in enumerate(rows):
                values = [quantity.read(gait) for gait in own]
                heights = [np.nan if value is None else value for value in values]
                panels[row, column].plot([g.values[key] for g in own], heights, marker="o", ms=4)
                if column == 0:
                    panels[row, 0].set_ylabel(f"{quantity.name}\n[{quantity.unit}]")
            panels[-1, column].set_xlabel(f"{key} [{_UNITS.get(key, 'ticks')}]")
        save(figure, path)


def _maps(gaits: Sequence[GaitMeasures], path: Path) -> None:
    """One map for each quantity over the two parameters, with its numbers."""
    across, upward = _keys(gaits)[:2]
    xs, ys = (sorted({gait.values[key] for gait in gaits}) for key in (across, upward))
    shown = quantities(gaits)
    with styled():
        figure = Figure(figsize=(11.0, 2.6 * -(-len(shown) // 2)))
        panels = figure.subplots(-(-len(shown) // 2), 2, squeeze=False).ravel()
        for axes in panels[len(shown) :]:
            axes.set_visible(False)
        for axes, quantity in zip(panels, shown, strict=False):
            grid = np.full((len(ys), len(xs)), np.nan)
            for gait in gaits:
                value = quantity.read(gait)
                grid[ys.index(gait.values[upward]), xs.index(gait.values[across])] = np.nan if value is None else value
            axes.imshow(grid, origin="lower", aspect="auto", cmap="Blues", alpha=0.7)
            axes.grid(False)
            for i, j in np.argwhere(np.isfinite(grid)):
                axes.text(j, i, f"{grid[i, j]:.3g}", ha="center", va="center", fontsize=8)
            axes.set_xticks(range(len(xs)), [f"{x:g}" for x in xs])
            axes.set_yticks(range(len(ys)), [f"{y:g}" for y in ys])
            axes.set_title(f"{quantity.name} [{quantity.unit}]")
            axes.set_xlabel(f"{across} [{_UNITS.get(across, 'ticks')}]")
            axes.set_ylabel(f"{upward} [{_UNITS.get(upward, 'ticks')}]")
        save(figure, path)


def _keys(gaits: Sequence[GaitMeasures]) -> list[str]:
    return list(dict.fromkeys(key for gait in gaits for key in gait.values))
