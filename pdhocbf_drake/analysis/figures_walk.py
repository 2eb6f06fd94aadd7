"""Figures of a walk, on the robot and on the template: CoM and ZMP, bounded quantities, footsteps, solver."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.barrier_margins import (
    barriers_of,
    bound_along,
    bounded_quantities,
    measured,
    planned,
    units_of,
)
from pdhocbf_drake.analysis.drawing import label, legend, panels, time_axis
from pdhocbf_drake.analysis.feet import sole_corners, touchdown_rows
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.barriers.recursion import psi_along
from pdhocbf_drake.simulation.run_folder import Run


def com_and_zmp(run: Run) -> Figure:
    """Measured and planned CoM and ZMP in x and y, over the ZMP box (27)."""
    log = run.log
    figure, axes = panels(2, height=2.8)
    for axis, name in zip(axes, "xy", strict=True):
        low, high = log.element("zmp_box", f"{name}_min"), log.element("zmp_box", f"{name}_max")
        axis.fill_between(log.time, low, high, color=palette.BOX, alpha=0.45, linewidth=0, label="ZMP box (27)")
        axis.plot(log.time, log.element("lip_state", f"{name}_zmp"), color=palette.MEASURED_ZMP, lw=0.8, label="ZMP")
        zmp_planned = log.element("zmp_reference", f"{name}_zmp")
        axis.plot(log.time, zmp_planned, color=palette.PLANNED_ZMP, ls="--", label="ZMP, planned")
        axis.plot(log.time, log.element("lip_state", name), color=palette.MEASURED_COM, label="CoM")
        com_planned = log.element("com_reference", name)
        axis.plot(log.time, com_planned, color=palette.PLANNED_COM, ls="--", label="CoM, planned")
        label(axis, name, "m")
    legend(axes[0], 5)
    time_axis(axes)
    return figure


def quantities_steady(run: Run) -> Figure:
    """Three gaits of `quantities` from the start of the steady state."""
    figure = quantities(run)
    start, log = run.scenario.from_time, run.log
    end = start + 3 * run.scenario.gait.ticks_per_gait * run.scenario.tick
    shown = (log.time >= start) & (log.time <= end)
    for axis in figure.axes:
        values = np.concatenate([np.asarray(line.get_ydata(), dtype=float)[shown] for line in axis.lines])
        axis.set_xlim(start, end)
        axis.set_ylim(*_room(values))
    return figure


def quantities(run: Run) -> Figure:
    """The bounded quantities and their bounds, as the paper's Fig. 4(b); the forward speed where nothing is bounded."""
    log, scenario = run.log, run.scenario
    bounded = bounded_quantities([scenario])
    figure, axes = panels(len(bounded), height=3.0)
    for axis, quantity in zip(axes, bounded, strict=True):
        axis.plot(log.time, measured(run, quantity), color=palette.MEASURED_COM, label="measured")
        axis.plot(log.time, planned(run, quantity), color=palette.PLANNED_COM, ls="--", label="planned")
        for barrier, use in barriers_of(scenario).items():
            if use.quantity == quantity:
                colour = palette.BARRIERS[use.column % len(palette.BARRIERS)]
                axis.plot(log.time, bound_along(log, scenario, use), color=colour, label=f"bound of {barrier}")
        label(axis, quantity.label, quantity.unit)
    legend(axes[0])
    time_axis(axes)
    return figure


def barriers(run: Run) -> Figure:
    """h and ψ_m on the measured state, as the paper's Fig. 4(c)."""
    log, scenario = run.log, run.scenario
    uses = barriers_of(scenario)
    figure, axes = panels(len(uses), height=2.6 if len(uses) == 1 else 1.9)
    for axis, (name, use) in zip(axes, uses.items(), strict=True):
        colour = palette.BARRIERS[use.column % len(palette.BARRIERS)]
        order = len(use.class_k)
        levels = psi_along(log["h"][:, use.column], use.class_k)
        axis.plot(log.time, levels[0], color=colour, label="h")
        axis.plot(log.time[: len(levels[-1])], levels[-1], color=palette.LIMIT, lw=0.7, label=f"$\\psi_{order}$")
        axis.axhline(0.0, color=palette.UNSAFE, lw=1.0, ls=":", label="limit of safety")
        axis.axvspan(0.0, min(scenario.from_time, log.time[-1]), color=palette.BOX, alpha=0.25, linewidth=0)
        if log.time[-1] > scenario.from_time:  # h is much larger during the start
            axis.set_ylim(*_room(np.append(levels[0][log.time >= scenario.from_time], 0.0)))
        axis.set_title(f"{name}: h, judged after the shaded start", loc="right")
        label(axis, "h", use.unit)
    legend(axes[0])
    time_axis(axes)
    return figure


def _room(values: np.ndarray) -> tuple[float, float]:
    """Limits of an axis with a fifth of the values' range above and below."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = 0.2 * (high - low) or 1.0
    return low - room, high + room


def footsteps(run: Run, limits: RobotLimits | None) -> Figure:
    """The ground from above: footholds planned and taken, the paths of CoM and ZMP."""
    log = run.log
    figure, (axis,) = panels(1, height=3.2)
    x, y = log.element("lip_state", "x"), log.element("lip_state", "y")
    axis.plot(log.element("lip_state", "x_zmp"), log.element("lip_state", "y_zmp"), color=palette.MEASURED_ZMP, lw=0.6,
              label="ZMP")  # fmt: skip
    axis.plot(x, y, color=palette.MEASURED_COM, label="CoM")
    if limits is not None:
        for index, (side, colour) in enumerate((("left", palette.LEFT), ("right", palette.RIGHT))):
            corners = sole_corners(log, side, limits.sole_half[index])
            for count, row in enumerate(touchdown_rows(log, side)):
                patch = Polygon(corners[row], closed=True, fc=colour, ec=colour, alpha=0.3)
                patch.set_label(f"{side} foot, taken" if count == 0 else "_")
                axis.add_patch(patch)
    starts = np.flatnonzero(np.diff(log.element("gait_phase", "step"), prepend=-1.0))
    planned = log["stance_plan"][starts][:, 2:4]
    axis.plot(*planned.T, ls="none", marker="+", ms=7, color="black", label="foothold, planned")
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel("x [m]")
    label(axis, "y", "m")
    legend(axis, 5)
    return figure


def solver(run: Run) -> Figure:
    """Wall time of the controller's ticks, and the barrier slack that their plans paid for."""
    log, scenario = run.log, run.scenario
    figure, axes = panels(2, height=1.9)
    seconds = log.element("solver_status", "time")[1:]
    axes[0].semilogy(
        log.time[1:], np.maximum(seconds, 1e-7) * 1e3, ".", ms=2, color=palette.MEASURED_COM, label="a tick"
    )
    axes[0].axhline(scenario.tick * 1e3, color=palette.LIMIT, ls=":", label="the sampling interval")
    label(axes[0], "wall time", "ms")
    if "barrier_slack" in log:
        for name, use in barriers_of(scenario).items():
            colour = palette.BARRIERS[use.column % len(palette.BARRIERS)]
            axes[1].plot(log.time, log["barrier_slack"][:, use.column], color=colour, label=f"slack of {name}")
    else:
        axes[1].plot(log.time, log.element("solver_status", "slack"), color=palette.UNSAFE, label="barrier slack")
    fell_back = log.element("solver_status", "fallbacks") > 0
    axes[1].plot(log.time[fell_back], np.zeros(fell_back.sum()), "kx", label="fallback")
    label(axes[1], "slack", units_of([scenario]))
    for axis in axes:
        legend(axis)
    time_axis(axes)
    return figure
