"""Figs. 2 and 3, schematics in the paper, drawn from the model itself: the pendulum and the ZMP boxes of two steps."""

from __future__ import annotations

import numpy as np
from matplotlib.patches import Rectangle

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import legend, panels
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.studies.reproduce.report import Number, Picture, Section
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.reproduce.walk import TEMPLATE
from pdhocbf_drake.studies.shared.cases import PERIODIC

_FIRST, _TICKS = 200, 80  # two steps of the settled walk
_EVERY = 5  # [ticks] between two drawn pendulums


def figures_2_and_3(runs: Runs) -> Section:
    """One gait of the template, from the side and from above."""
    run = runs.run(TEMPLATE[PERIODIC])
    rows = np.arange(_FIRST, _FIRST + _TICKS + 1)
    config = run.scenario.gait
    return Section(
        "Figs. 2 and 3: the pendulum and its ZMP boxes",
        ["Both are drawn from the log of the template's walk: they show the model itself, not a sketch of it."],
        [_side(run.log, rows), _above(run.log, rows)],
        numbers=[
            Number("nominal CoM height Z_com, (24)", 0.58, config.com_height, "m", 0.0),
            Number("side of the ZMP box, (27)", 0.1, config.zmp_box[0], "m", 0.0),
            Number("sampling interval", 0.01, config.tick, "s", 0.0),
            Number("horizon H, Lemma 2", 80, run.scenario.mpc.horizon, "ticks", 0.0),
        ],
        finding="With no double support the ZMP crosses from box to box within a tick; these boxes do not overlap.",
    )


def _side(log: RunLog, rows: np.ndarray) -> Picture:
    """Fig. 2, from the side."""
    x, zmp = log.element("lip_state", "x")[rows], log.element("lip_state", "x_zmp")[rows]
    height = log.element("com_height", "z")[rows]
    figure, (axes,) = panels(1, height=5.1, width=6.0)
    drawn = slice(None, None, _EVERY)
    rods = np.array([zmp[drawn], x[drawn]]), np.array([0.0 * zmp[drawn], height[drawn]])
    first, *_ = axes.plot(*rods, color=palette.LIMIT, lw=0.8, alpha=0.6)
    first.set_label(f"pendulum, every {_EVERY} ticks")
    axes.plot(x, height, color=palette.MEASURED_COM, label="CoM")
    axes.plot(x[drawn], height[drawn], "o", ms=6, color=palette.MEASURED_COM)
    axes.plot(zmp, np.zeros(len(rows)), ".", ms=4, color=palette.MEASURED_ZMP, label="ZMP at each tick")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [m]", ylabel="z [m]")
    legend(axes, 3)
    data = {"tick": rows, "CoM x [m]": x, "CoM z [m]": height, "ZMP x [m]": zmp}
    return Picture("fig2", "Fig. 2: the VHIP over one gait; the height follows (24).", figure, data)


def _above(log: RunLog, rows: np.ndarray) -> Picture:
    """Fig. 3, from above."""
    figure, (axes,) = panels(1, height=3.9)
    box, support = log["zmp_box"][rows], log.element("gait_phase", "support")[rows]
    boxes = {tuple(np.round(corners, 6)): side for corners, side in zip(box, support, strict=True)}
    for foot, sign, colour in (("left", 1, palette.LEFT), ("right", -1, palette.RIGHT)):
        name: str | None = f"ZMP box (27), {foot} foot"
        for left, right, low, high in (corners for corners, side in boxes.items() if side * sign > 0):
            axes.add_patch(
                Rectangle((left, low), right - left, high - low, fc=colour, alpha=0.25, ec=colour, label=name)
            )
            name = None  # in the legend once
    zmp, com = (np.stack([log.element("lip_state", a + end)[rows] for a in "xy"]) for end in ("_zmp", ""))
    axes.plot(*zmp, ".", ms=5, color=palette.MEASURED_ZMP, label="ZMP at each tick")
    axes.plot(*com, color=palette.MEASURED_COM, label="CoM")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    legend(axes, 4)
    data = {"tick": rows, "CoM x [m]": com[0], "CoM y [m]": com[1], "ZMP x [m]": zmp[0], "ZMP y [m]": zmp[1]}
    data |= {f"box {name} [m]": box[:, i] for i, name in enumerate(("x_min", "x_max", "y_min", "y_max"))}
    return Picture("fig3", "Fig. 3: ZMP boxes, ZMP and CoM of one gait, from above.", figure, data)
