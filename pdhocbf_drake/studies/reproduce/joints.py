"""Fig. 6: joint angles of both legs from the robot's log, with their limits; beyond it, velocities and torques."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, time_axis
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.studies.reproduce.report import Number, Picture, Section, Table
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.reproduce.walk import ROBOT
from pdhocbf_drake.studies.shared.cases import PERIODIC
from pdhocbf_drake.systems.signals import JOINTS

Array = NDArray[np.float64]

_SHOWN = slice(0, 401)
_STEADY = 200  # [ticks]
_LEG = [joint.removeprefix("left_").replace("_", " ") for joint in JOINTS[:6]]


def figure_6(runs: Runs) -> Section:
    """Angles, velocities and torques, and the part of each limit that they use."""
    run = runs.run(ROBOT[PERIODIC])
    limits = robot_limits(run.scenario)
    if limits is None:
        raise RuntimeError("Fig. 6 needs a robot")
    log = run.log
    state, torque = log["joint_state"], log["actuation"]
    angle, speed = np.degrees(state[:, :12]), state[:, 12:]
    time = log.time[_SHOWN]
    effort, fastest = np.column_stack([-limits.effort, limits.effort]), np.column_stack([-limits.speed, limits.speed])
    pictures = [
        both_legs("fig6", "Fig. 6: joint angles", time, angle, np.degrees(limits.position), "angle", "deg"),
        both_legs("fig6_velocities", "Beyond Fig. 6: joint velocities", time, speed, fastest, "velocity", "rad/s"),
        both_legs("fig6_torques", "Beyond Fig. 6: torques", time, torque, effort, "torque", "N m"),
    ]
    rows = []
    for i, joint in enumerate(JOINTS):
        low, high = np.degrees(limits.position[i])
        rows.append({
            "joint": joint.replace("_", " "),
            "angle [deg]": f"{angle[:, i].min():.1f} … {angle[:, i].max():.1f}",
            "limits [deg]": f"{low:.0f} … {high:.0f}",
            "largest speed [rad/s]": f"{np.abs(speed[:, i]).max():.1f}",
            "limit [rad/s]": f"{limits.speed[i]:.0f}",
            "largest torque [N m]": f"{np.abs(torque[:, i]).max():.0f}",
            "limit [N m]": f"{limits.effort[i]:.0f}",
        })  # fmt: skip
    gait = run.scenario.gait.ticks_per_gait
    repeats = float(np.abs(angle[_STEADY + gait :] - angle[_STEADY:-gait]).max())
    within = bool(np.all((state[:, :12] >= limits.position[:, 0]) & (state[:, :12] <= limits.position[:, 1])))
    return Section(
        "Fig. 6: joint angles",
        [
            "Measured angles of the robot in the walk of Fig. 4, Case 2. "
            + ("All stay within their limits." if within else "Some leave their limits, see the table.")
        ],
        pictures,
        [Table("Joint angles, speeds and torques of the whole run, with their limits", rows)],
        [Number("degrees of freedom of the robot", 12, len(JOINTS), "1", 0.0)],
        f"From {log.time[_STEADY]:g} s on every angle repeats after a gait to {repeats:.2f} deg.",
    )


def both_legs(name: str, title: str, time: Array, values: Array, limits: Array, quantity: str, unit: str) -> Picture:
    """Each leg over time, and beside it the limits of each joint and the part of them that the whole run uses.

    Args:
        name, title: file name of the picture, and the beginning of its caption.
        time: of the rows that are drawn, (T,) [s].
        values: of the joints over the whole run, (≥ T, 12) [unit].
        limits: lower and upper one of each joint, (12, 2) [unit].
        quantity, unit: of the values.
    """
    figure = Figure(figsize=(8.5, 5.6))
    axes = figure.subplots(2, 2, sharex="col", sharey="col", width_ratios=[4.0, 1.0])
    data: dict[str, Sequence[float] | Array] = {"time [s]": time}
    for side, (curves, bars) in enumerate(axes):
        for joint, colour in enumerate(palette.JOINTS):
            index = 6 * side + joint
            style = "-" if joint % 2 == 0 else "--"
            curves.plot(time, values[_SHOWN, index], color=colour, lw=1.2, ls=style, label=_LEG[joint])
            low, high = limits[index]
            bars.bar(joint, high - low, 0.9, low, color=colour, alpha=0.3)
            bars.bar(joint, np.ptp(values[:, index]), 0.5, values[:, index].min(), color=colour)
            data[f"{JOINTS[index]} [{unit}]"] = values[_SHOWN, index]
            data[f"{JOINTS[index]}, lower limit [{unit}]"] = np.full(len(time), low)
            data[f"{JOINTS[index]}, upper limit [{unit}]"] = np.full(len(time), high)
        curves.set_title(("left leg", "right leg")[side], loc="right")
        bars.set_title("limits (pale), used")
        bars.set_xticks([])
        bars.margins(y=0.05)
        bars.use_sticky_edges = False
        label(curves, quantity, unit)
        label(bars, quantity, unit)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=6)
    time_axis(list(axes[:, 0]))
    caption = f"{title}. Right, on a scale of its own: each joint's limits and the part that the whole run uses."
    return Picture(name, caption, figure, data)
