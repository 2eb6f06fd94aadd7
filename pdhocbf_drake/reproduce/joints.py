"""Fig. 6: joint angles of both legs from the robot's log, with their limits; beyond it, velocities and torques."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, legend, panels, time_axis
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.reproduce.record import Number, Picture, Section, Table
from pdhocbf_drake.reproduce.runs import Runs
from pdhocbf_drake.reproduce.walk import ROBOT
from pdhocbf_drake.simulation.signals import JOINTS

_SHOWN = slice(0, 401)
_LEG = [joint.removeprefix("left_").replace("_", " ") for joint in JOINTS[:6]]


def figure_6(runs: Runs) -> Section:
    """Angles, velocities, torques, and how much of each limit they use."""
    run = runs.run(*ROBOT["periodic"])
    limits = robot_limits(run.scenario)
    if limits is None:
        raise RuntimeError("Fig. 6 needs a robot")
    log = run.log
    state, torque = log["joint_state"], log["actuation"]
    angle, speed = np.degrees(state[:, :12]), state[:, 12:]
    time = log.time[_SHOWN]
    pictures = [
        _legs("fig6", "Fig. 6: joint angles of both legs.", time, angle[_SHOWN], "angle", "deg"),
        _legs("fig6_velocities", "Beyond Fig. 6: joint velocities.", time, speed[_SHOWN], "velocity", "rad/s"),
        _legs("fig6_torques", "Beyond Fig. 6: torques.", time, torque[_SHOWN], "torque", "N m"),
    ]
    rows = []
    for i, joint in enumerate(JOINTS):
        low, high = np.degrees(limits.position[i])
        rows.append(
            (
                joint.replace("_", " "),
                f"{angle[:, i].min():.1f} … {angle[:, i].max():.1f}",
                f"{low:.0f} … {high:.0f}",
                f"{np.abs(speed[:, i]).max():.1f}",
                f"{limits.speed[i]:.0f}",
                f"{np.abs(torque[:, i]).max():.0f}",
                f"{limits.effort[i]:.0f}",
            )
        )
    within = bool(np.all((state[:, :12] >= limits.position[:, 0]) & (state[:, :12] <= limits.position[:, 1])))
    header = ("joint", "angle [deg]", "limits [deg]", "largest speed [rad/s]", "limit", "largest torque [N m]", "limit")
    return Section(
        "Fig. 6: joint angles",
        [
            "Measured angles of the robot in the walk of Fig. 4, Case 2. All stay within their limits: "
            + ("yes." if within else "no.")
        ],
        pictures,
        [Table("What the walk asks of the joints, over the whole run", header, rows)],
        [Number("degrees of freedom of the robot", 12, len(JOINTS), "1", 0.0, False, "pdhocbf reproduce --only fig6")],
        "The walk repeats in every joint from the third step on.",
    )


def _legs(
    name: str, caption: str, time: NDArray[np.float64], values: NDArray[np.float64], quantity: str, unit: str
) -> Picture:
    figure, axes = panels(2, height=2.4)
    data: dict[str, Sequence[float] | NDArray[np.float64]] = {"time [s]": time}
    for side, axis in enumerate(axes):
        for joint, colour in enumerate(palette.JOINTS):
            style = "-" if joint % 2 == 0 else "--"
            axis.plot(time, values[:, 6 * side + joint], color=colour, lw=1.2, ls=style, label=_LEG[joint])
            data[f"{JOINTS[6 * side + joint]} [{unit}]"] = values[:, 6 * side + joint]
        axis.set_title(("left leg", "right leg")[side], loc="right")
        label(axis, quantity, unit)
    legend(axes[0], 6)
    time_axis(axes)
    return Picture(name, caption, figure, data)
