"""Figs. 2 and 3, schematics in the paper, drawn from the model itself: the pendulum and the ZMP boxes of two steps."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, legend
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.studies.reproduce.report import Number, Picture, Section
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.reproduce.walk import TEMPLATE
from pdhocbf_drake.studies.shared.cases import PERIODIC

_FIRST, _TICKS = 200, 80  # two steps of the settled walk
_EVERY = 5  # ticks between two drawn pendulums


def figures_2_and_3(runs: Runs) -> Section:
    """One gait of the template, from the side and from above."""
    run = runs.run(*TEMPLATE[PERIODIC])
    rows = np.arange(_FIRST, _FIRST + _TICKS + 1)
    config = run.scenario.gait
    command = "pdhocbf reproduce --only fig2"
    return Section(
        "Figs. 2 and 3: the pendulum and its ZMP boxes",
        ["Both are drawn from the log of the template's walk: what is shown is the model, not a sketch of it."],
        [_side(run.log, rows), _above(run.log, rows)],
        numbers=[
            Number("nominal CoM height Z_com, (24)", 0.58, config.com_height, "m", command, 0.0),
            Number("side of the ZMP box, (27)", 0.1, config.zmp_box[0], "m", command, 0.0),
            Number("sampling interval", 0.01, config.tick, "s", command, 0.0),
            Number("horizon H, Lemma 2", 80, run.scenario.mpc.horizon, "ticks", command, 0.0),
        ],
        finding="With no double support the ZMP crosses from box to box within a tick; these boxes do not overlap.",
    )


def _side(log: RunLog, rows: np.ndarray) -> Picture:
    x, zmp = log.element("lip_state", "x")[rows], log.element("lip_state", "x_zmp")[rows]
    height = log.element("com_height", "z")[rows]
    figure = Figure(figsize=(6.0, 5.6))
    axes = figure.subplots()
    for i in range(0, len(rows), _EVERY):
        axes.plot(
            [zmp[i], x[i]],
            [0, height[i]],
            color=palette.LIMIT,
            lw=0.8,
            alpha=0.6,
            label="pendulum, every 5 ticks" if i == 0 else None,
        )
    axes.plot(x, height, color=palette.MEASURED_COM, label="CoM")
    axes.plot(x[::_EVERY], height[::_EVERY], "o", ms=6, color=palette.MEASURED_COM)
    axes.plot(zmp, np.zeros(len(rows)), ".", ms=4, color=palette.MEASURED_ZMP, label="ZMP at each tick")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [m]")
    label(axes, "z", "m")
    legend(axes, 3)
    data = {"tick": rows, "CoM x [m]": x, "CoM z [m]": height, "ZMP x [m]": zmp}
    return Picture("fig2", "Fig. 2: the VHIP over one gait; the height follows (24).", figure, data)


def _above(log: RunLog, rows: np.ndarray) -> Picture:
    figure = Figure(figsize=(8.5, 4.4))
    axes = figure.subplots()
    box = log["zmp_box"][rows]
    support = log.element("gait_phase", "support")[rows]
    labelled = set()
    for corner, side in {tuple(np.round(b, 6)): s for b, s in zip(box, support, strict=True)}.items():
        name = "left" if side > 0 else "right"
        colour = palette.LEFT if side > 0 else palette.RIGHT
        patch = Rectangle(
            (corner[0], corner[2]), corner[1] - corner[0], corner[3] - corner[2], fc=colour, alpha=0.25, ec=colour
        )
        if name not in labelled:
            patch.set_label(f"ZMP box (27), {name} foot")
            labelled.add(name)
        axes.add_patch(patch)
    zmp = np.stack([log.element("lip_state", f"{a}_zmp")[rows] for a in "xy"])
    com = np.stack([log.element("lip_state", a)[rows] for a in "xy"])
    axes.plot(*zmp, ".", ms=5, color=palette.MEASURED_ZMP, label="ZMP at each tick")
    axes.plot(*com, color=palette.MEASURED_COM, label="CoM")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [m]")
    label(axes, "y", "m")
    legend(axes, 4)
    data = {"tick": rows, "CoM x [m]": com[0], "CoM y [m]": com[1], "ZMP x [m]": zmp[0], "ZMP y [m]": zmp[1]}
    data |= {f"box {name} [m]": box[:, i] for i, name in enumerate(("x_min", "x_max", "y_min", "y_max"))}
    return Picture("fig3", "Fig. 3: ZMP boxes, ZMP and CoM of one gait, from above.", figure, data)
