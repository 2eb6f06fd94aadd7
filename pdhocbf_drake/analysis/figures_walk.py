"""Figures of a walk, on the robot and on the template: CoM and ZMP, bounded quantities, footsteps, solver."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.barrier_margins import (
    barriers_of,
    bound_along,
    h_along,
    measured,
    named,
    planned,
    psi_along_log,
    quantities_of,
    units_of,
)
from pdhocbf_drake.analysis.drawing import label, legend, over_time, panels
from pdhocbf_drake.analysis.feet import sole_corners, step_starts, touchdown_rows
from pdhocbf_drake.analysis.heading import commanded_path, seen_from_path
from pdhocbf_drake.analysis.pushes import Span, spans_of
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.simulation.run_folder import Run


def com_and_zmp(run: Run) -> Figure:
    """Measured and planned CoM and ZMP in x and y, over the ZMP box (27); under commands seen from their path."""
    log = seen_from_path(run.log)
    figure, axes = panels(2, height=2.8)
    for axis, name in zip(axes, "xy", strict=True):
        low, high = log.element("zmp_box", f"{name}_min"), log.element("zmp_box", f"{name}_max")
        axis.fill_between(log.time, low, high, color=palette.BOX, alpha=0.45, linewidth=0, label="ZMP box (27)")
        axis.plot(log.time, log.element("lip_state", f"{name}_zmp"), color=palette.MEASURED_ZMP, lw=0.8, label="ZMP")
        planned_zmp = log.element("zmp_reference", f"{name}_zmp")
        axis.plot(log.time, planned_zmp, color=palette.PLANNED_ZMP, ls="--", label="ZMP, planned")
        axis.plot(log.time, log.element("lip_state", name), color=palette.MEASURED_COM, label="CoM")
        planned_com = log.element("com_reference", name)
        axis.plot(log.time, planned_com, color=palette.PLANNED_COM, ls="--", label="CoM, planned")
        label(axis, name, "m")
    return over_time(figure, 6, pushes=spans_of(run))


def quantities_steady(run: Run) -> Figure:
    """Three gaits of `quantities` from the start of the steady state."""
    start, log = run.scenario.from_time, run.log
    end = start + 3 * run.scenario.gait.ticks_per_gait * run.scenario.tick
    figure = quantities(run, (start, end))
    steady = (log.time >= start) & (log.time <= end)
    for axis in figure.axes:
        values = np.concatenate([np.asarray(line.get_ydata(), dtype=float)[steady] for line in axis.lines])
        axis.set_xlim(start, end)
        axis.set_ylim(*_with_space(values))
    return figure


def quantities(run: Run, shown: Span = (-np.inf, np.inf)) -> Figure:
    """The bounded quantities and their bounds, as the paper's Fig. 4(b); the forward speed where nothing is bounded.

    Only the pushes within a span of time [s] are marked.
    """
    log, scenario = run.log, run.scenario
    bounded = quantities_of([scenario])
    figure, axes = panels(len(bounded), height=3.0)
    for axis, quantity in zip(axes, bounded, strict=True):
        axis.plot(log.time, measured(run, quantity), color=palette.MEASURED_COM, label="measured")
        axis.plot(log.time, planned(run, quantity), color=palette.PLANNED_COM, ls="--", label="planned")
        for barrier, use in barriers_of(scenario).items():
            if use.quantity == quantity:
                colour = palette.barrier_colour(use.column)
                axis.plot(log.time, bound_along(log, scenario, use), color=colour, label=f"bound of {barrier}")
        label(axis, named(run, quantity), quantity.unit)
    low, high = shown
    pushes = [(start, end) for start, end in spans_of(run) if end > low and start < high]
    return over_time(figure, pushes=pushes)


def barriers(run: Run) -> Figure:
    """h and ψ_m on the measured state, as the paper's Fig. 4(c)."""
    log, scenario = run.log, run.scenario
    uses = barriers_of(scenario)
    figure, axes = panels(len(uses), height=2.6 if len(uses) == 1 else 1.9)
    for axis, (name, use) in zip(axes, uses.items(), strict=True):
        colour = palette.barrier_colour(use.column)
        order = len(use.class_k)
        h, psi = h_along(log, scenario, use), psi_along_log(log, use)
        axis.plot(log.time, h, color=colour, label="h")
        axis.plot(log.time[: len(psi)], psi, color=palette.LIMIT, lw=0.7, label=f"$\\psi_{order}$")
        axis.axhline(0.0, color=palette.UNSAFE, lw=1.0, ls=":", label="limit of safety")
        axis.axvspan(0.0, min(scenario.from_time, log.time[-1]), color=palette.BOX, alpha=0.25, linewidth=0)
        if log.time[-1] > scenario.from_time:  # h is much larger during the start
            axis.set_ylim(*_with_space(np.append(h[log.time >= scenario.from_time], 0.0)))
        axis.set_title(f"{name}: h, judged after the shaded start", loc="right")
        label(axis, "h", use.unit)
    return over_time(figure, pushes=spans_of(run))


def _with_space(values: np.ndarray) -> tuple[float, float]:
    """Limits of an axis that leave a fifth of the values' range above and below them."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    space = 0.2 * (high - low) or 1.0
    return low - space, high + space


def footsteps(run: Run, limits: RobotLimits | None) -> Figure:
    """The ground from above: planned and taken footholds, the paths of CoM and ZMP."""
    log = run.log
    x, _, x_zmp, y, _, y_zmp = log["lip_state"].T
    # As high as the ground that is walked on needs, and as its figure's width allows [inches].
    length, width = (float(np.ptp(np.nan_to_num(places, posinf=0.0, neginf=0.0))) + 0.5 for places in (x, y))
    figure, (axis,) = panels(1, height=min(max(3.2, 8.0 * width / length), 7.0))
    axis.plot(x_zmp, y_zmp, color=palette.MEASURED_ZMP, lw=0.6, label="ZMP")
    axis.plot(x, y, color=palette.MEASURED_COM, label="CoM")
    if "path" in log:
        gait = run.scenario.gait
        path = commanded_path(log, gait.ticks_per_step, gait.tick)
        axis.plot(*path[:, :2].T, color=palette.PLANNED_COM, ls=":", label="path, commanded")
    if limits is not None:
        for index, (side, colour) in enumerate((("left", palette.LEFT), ("right", palette.RIGHT))):
            corners = sole_corners(log, side, limits.sole_half[index])[:, :, :2]
            for count, row in enumerate(touchdown_rows(log, side)):
                later = row / len(log)  # is drawn over what was before
                patch = Polygon(corners[row], closed=True, fc=colour, ec=colour, alpha=0.3, zorder=1.0 + later)
                patch.set_label(f"{side} foot, taken" if count == 0 else "_")
                axis.add_patch(patch)
    axis.plot(
        *log["stance_plan"][step_starts(log), 2:4].T,
        ls="none",
        marker="+",
        ms=7,
        color="black",
        label="foothold, planned",
    )
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel("x [m]")
    label(axis, "y", "m")
    legend(axis, 5)
    return figure


def solver(run: Run) -> Figure:
    """Wall time of the controller's ticks, and the barrier slack that their plans paid for."""
    log, scenario = run.log, run.scenario
    figure, axes = panels(2, height=1.9)
    milliseconds = 1e3 * np.maximum(log.element("solver_status", "time")[1:], 1e-7)
    axes[0].semilogy(log.time[1:], milliseconds, ".", ms=2, color=palette.MEASURED_COM, label="a tick")
    axes[0].axhline(scenario.tick * 1e3, color=palette.LIMIT, ls=":", label="the sampling interval")
    label(axes[0], "wall time", "ms")
    if "barrier_slack" in log:
        for name, use in barriers_of(scenario).items():
            colour = palette.barrier_colour(use.column)
            axes[1].plot(log.time, log["barrier_slack"][:, use.column], color=colour, label=f"slack of {name}")
    else:
        axes[1].plot(log.time, log.element("solver_status", "slack"), color=palette.UNSAFE, label="barrier slack")
    fell_back = log.element("solver_status", "fallbacks") > 0
    axes[1].plot(log.time[fell_back], np.zeros(fell_back.sum()), "kx", label="fallback")
    label(axes[1], "slack", units_of([scenario]))
    return over_time(figure, every_panel=True, pushes=spans_of(run))
