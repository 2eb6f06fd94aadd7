"""Figures of the robot's body: tracking errors, joint angles as the paper's Fig. 6, torques."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, over_time, panels
from pdhocbf_drake.analysis.feet import zmp_margins
from pdhocbf_drake.analysis.heights import commanded_com_height
from pdhocbf_drake.analysis.pushes import spans_of
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.systems.signals import JOINTS

_LEG = [joint.removeprefix("left_").replace("_", " ") for joint in JOINTS[:6]]


def tracking(run: Run, limits: RobotLimits) -> Figure:
    """The CoM's deviation from its plan, and the distance of the ZMP from the edge of the support."""
    log = run.log
    figure, axes = panels(2, height=2.3)
    for name, colour in zip("xy", (palette.JOINTS[0], palette.JOINTS[4]), strict=True):
        error = log.element("lip_state", name) - log.element("com_reference", name)
        axes[0].plot(log.time, 1e3 * error, color=colour, lw=1.0, label=f"CoM {name}, measured less planned")
    height = log.element("com_z", "z") - commanded_com_height(log)
    axes[0].plot(log.time, 1e3 * height, color=palette.JOINTS[2], lw=1.0, label="CoM height, measured less commanded")
    label(axes[0], "error", "mm")
    margins = zmp_margins(log, limits.sole_half, run.scenario.terrain)
    axes[1].plot(log.time, 1e3 * margins, color=palette.MEASURED_ZMP, lw=0.8, label="ZMP to the edge of the support")
    axes[1].axhline(0.0, color=palette.LIMIT, ls=":")
    label(axes[1], "margin", "mm")
    return over_time(figure, 3, every_panel=True, pushes=spans_of(run))


def joints(run: Run) -> Figure:
    """Measured joint angles of both legs."""
    return _by_leg(run, np.degrees(run.log["joint_state"][:, : len(JOINTS)]), "leg", "deg", 1.1)


def torques(run: Run, limits: RobotLimits) -> Figure:
    """Applied torques as a share of each joint's effort limit."""
    figure = _by_leg(run, 100.0 * run.log["actuation"] / limits.effort, "leg torque", "% of limit", 0.9)
    for axis in figure.axes:
        for limit in (-100.0, 100.0):
            axis.axhline(limit, color=palette.LIMIT, ls=":")
    return figure


def _by_leg(run: Run, values: np.ndarray, name: str, unit: str, width: float) -> Figure:
    """A panel a leg, with a line of `width` points for each of its joints; `values` has shape (T, 12)."""
    figure, axes = panels(2)
    for first, side, axis in zip((0, 6), ("left", "right"), axes, strict=True):
        for joint, colour in enumerate(palette.JOINTS):
            axis.plot(run.log.time, values[:, first + joint], color=colour, lw=width, label=_LEG[joint])
        label(axis, f"{side} {name}", unit)
    return over_time(figure, 6, pushes=spans_of(run))
