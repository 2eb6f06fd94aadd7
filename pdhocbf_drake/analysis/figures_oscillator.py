"""Figures of the Van der Pol oscillator in its tube, as the paper's Fig. 1."""

from __future__ import annotations

from matplotlib.figure import Figure

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, legend, over_time, panels
from pdhocbf_drake.simulation.run_folder import Run

_UNITS = ("1", "1/s")


def tubes(run: Run) -> Figure:
    """Both states between their periodic bounds (18), and the input that keeps them there."""
    log = run.log
    figure, axes = panels(3, height=2.1)
    for state in range(2):
        values = log["oscillator_state"][:, state]
        # h is the distance from the bound, so the bounds are where they were at that tick.
        upper, lower = values + log["h"][:, 2 * state], values - log["h"][:, 2 * state + 1]
        axes[state].fill_between(log.time, lower, upper, color=palette.BOX, alpha=0.45, lw=0, label="tube (18)")
        axes[state].plot(log.time, values, color=palette.MEASURED_COM, label="state")
        label(axes[state], f"x{state + 1}", _UNITS[state])
    axes[2].plot(log.time, log["oscillator_input"][:, 0], color=palette.MEASURED_ZMP, lw=1.0, label="input")
    label(axes[2], "u", "1/s²")
    return over_time(figure)


def phase(run: Run) -> Figure:
    """x₂ over x₁, with the bounds of both at every tick."""
    log = run.log
    figure, (axis,) = panels(1, height=4.5, width=5.2)
    x1, x2 = log["oscillator_state"].T
    h = log["h"]
    axis.plot(x1 + h[:, 0], x2 + h[:, 2], color=palette.BARRIERS[0], lw=0.8, ls="--", label="upper bounds")
    axis.plot(x1 - h[:, 1], x2 - h[:, 3], color=palette.BARRIERS[1], lw=0.8, ls="--", label="lower bounds")
    axis.plot(x1, x2, color=palette.MEASURED_COM, label="state")
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel("x1 [1]")
    label(axis, "x2", "1/s")
    legend(axis, 3)
    return figure
