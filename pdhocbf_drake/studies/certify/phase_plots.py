"""Plots of (c, v), CoM from the foot and its velocity, at a few phases of a step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pdhocbf_drake.analysis.drawing import label
from pdhocbf_drake.walking.quantities import SPEEDS

_SHOWN = 6  # phases


def phase_plots(axis: int, period: int, draw: Callable[[Axes, int], None], columns: int) -> Figure:
    """A figure of six phases, evenly spread over a period.

    Args:
        axis: 0 for x, 1 for y.
        period: in ticks.
        draw: draws what there is at a phase.
        columns: of the legend.
    """
    figure = Figure(figsize=(9.0, 5.6))
    plots = figure.subplots(2, _SHOWN // 2, sharex=True, sharey=True)
    for plot, phase in zip(plots.flat, np.linspace(0, period - 1, _SHOWN).round().astype(int), strict=True):
        draw(plot, int(phase))
        plot.set_title(f"phase {phase}")
    for plot in plots[:, 0]:
        label(plot, SPEEDS[axis].label, SPEEDS[axis].unit)
    for plot in plots[-1]:
        plot.set_xlabel(f"CoM {'xy'[axis]} from the foot [m]")
    handles, names = plots.flat[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=columns)
    return figure
