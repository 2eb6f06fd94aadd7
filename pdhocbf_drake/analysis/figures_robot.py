"""Figures of the robot's body: tracking errors, joint angles as the paper's Fig. 6, torques."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, legend, panels, time_axis
from pdhocbf_drake.analysis.feet import zmp_margins
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.systems.signals import JOINTS

_SIDES = ("left", "right")
_LEG = [joint.removeprefix("left_").replace("_", " ") for joint in JOINTS[:6]]


def tracking(run: Run, limits: RobotLimits) -> Figure:
    """How far the robot is from its plan, and the ZMP from the edge of the soles."""
    log = run.log
    figure, axes = panels(2, height=2.3)
    for name, colour in zip("xy", (palette.JOINTS[0], palette.JOINTS[4]), strict=True):
        error = log.element("lip_state", name) - log.element("com_reference", name)
        axes[0].plot(log.time, 1e3 * error, color=colour, lw=1.0, label=f"CoM {name}, measured less planned")
    height = log.element("com_z", "z") - log.element("com_height", "z")
    axes[0].plot(log.time, 1e3 * height, color=palette.JOINTS[2], lw=1.0, label="CoM height, measured less commanded")
    label(axes[0], "error", "mm")
    axes[1].plot(log.time, 1e3 * zmp_margins(log, limits.sole_half), color=palette.MEASURED_ZMP, lw=0.8,
                 label="ZMP to the edge of the support")  # fmt: skip
    axes[1].axhline(0.0, color=palette.LIMIT, ls=":")
    label(axes[1], "margin", "mm")
    for axis in axes:
        legend(axis, 3)
    time_axis(axes)
    return figure


def joints(run: Run) -> Figure:
    """Measured joint angles of both legs."""
    log = run.log
    figure, axes = panels(2)
    for side, axis in enumerate(axes):
        for joint, colour in enumerate(palette.JOINTS):
            angle = np.degrees(log["joint_state"][:, 6 * side + joint])
            axis.plot(log.time, angle, color=colour, lw=1.1, label=_LEG[joint])
        label(axis, f"{_SIDES[side]} leg", "deg")
    legend(axes[0], 6)
    time_axis(axes)
    return figure


def torques(run: Run, limits: RobotLimits) -> Figure:
    """Applied torques as a share of each joint's effort limit."""
    log = run.log
    figure, axes = panels(2)
    for side, axis in enumerate(axes):
        for joint, colour in enumerate(palette.JOINTS):
            index = 6 * side + joint
            share = 100.0 * log["actuation"][:, index] / limits.effort[index]
            axis.plot(log.time, share, color=colour, lw=0.9, label=_LEG[joint])
        for limit in (-100.0, 100.0):
            axis.axhline(limit, color=palette.LIMIT, ls=":")
        label(axis, f"{_SIDES[side]} leg torque", "% of limit")
    legend(axes[0], 6)
    time_axis(axes)
    return figure
