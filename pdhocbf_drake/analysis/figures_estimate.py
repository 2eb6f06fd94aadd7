"""Figure of the estimate from the sensors beside the truth, with its own uncertainty."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, over_time, panels
from pdhocbf_drake.analysis.estimate import NEES_LIMIT
from pdhocbf_drake.analysis.pushes import spans_of
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import RunLog


def estimate(run: Run) -> Figure:
    """Forward velocity, true and estimated, then errors of velocity and CoM within 2σ, and their normalized square."""
    log = run.log
    figure, axes = panels(4, height=1.9)
    axes[0].plot(log.time, log.element("lip_state", "vx"), color=palette.MEASURED_COM, label="CoM velocity x, true")
    axes[0].plot(log.time, log.element("lip_estimate", "vx"), color=palette.RUNS[0], ls="--", lw=1.0, label="estimated")
    label(axes[0], "velocity", "m/s")
    colours = palette.RUNS[:2]
    for axis, colour in zip("xy", colours, strict=True):
        error = log.element("lip_estimate", f"v{axis}") - log.element("lip_state", f"v{axis}")
        _band(axes[1], log, 1e3 * error, 2e3 * log.element("estimate_deviation", f"v{axis}"), axis, colour)
        _band(axes[2], log, 1e3 * from_stance(log, axis), 2e3 * log.element("estimate_deviation", axis), axis, colour)
    label(axes[1], "velocity error", "mm/s")
    label(axes[2], "CoM error from stance", "mm")
    axes[3].semilogy(log.time, log.element("estimate_error", "nees"), color=palette.RUNS[2], lw=0.8, label="NEES")
    axes[3].axhline(NEES_LIMIT, color=palette.LIMIT, ls=":", label="95 % of χ²")
    label(axes[3], "NEES", "1")
    return over_time(figure, 4, every_panel=True, pushes=spans_of(run))


def from_stance(log: RunLog, axis: str) -> np.ndarray:
    """Error of the CoM counted from the stance foot, (T,) [m]."""
    right = log.element("estimator_status", "held") > 0.0
    gaps = []
    for com, feet in (("lip_estimate", "foot_estimate"), ("lip_state", "foot_state")):
        foot = np.where(right, log.element(feet, f"right_{axis}"), log.element(feet, f"left_{axis}"))
        gaps.append(log.element(com, axis) - foot)
    error: np.ndarray = gaps[0] - gaps[1]
    return error


def _band(axes: Axes, log: RunLog, error: np.ndarray, width: np.ndarray, axis: str, colour: str) -> None:
    axes.fill_between(log.time, -width, width, color=colour, alpha=0.15, lw=0.0, label=f"{axis}, ± 2σ")
    axes.plot(log.time, error, color=colour, lw=0.8, label=f"{axis}, estimated less true")
