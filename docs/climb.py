"""Draws a walk up stairs from the side: `python docs/climb.py` writes climb.svg beside this file.

The walk is that of `walking_stairs`: ground, measured paths of both soles' centres, the soles where they stand, the
line under the CoM, and the CoM as planned and as measured.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from pdhocbf_drake import load_scenario, simulate
from pdhocbf_drake.analysis.heights import commanded_com_height
from pdhocbf_drake.analysis.palette import LEFT, MEASURED_COM, PLANNED_COM, RIGHT
from pdhocbf_drake.robot import SIDES, Biped
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario

PAGE: Final = Path(__file__).parent / "climb.svg"
WALK: Final = "walking_stairs"
FIRST, LAST = 0.7, 2.45  # x that is drawn [m]
MIDDLE: Final = 20  # tick of a step at which its stance foot is drawn


def main() -> None:
    """Writes climb.svg."""
    scenario = load_scenario(WALK)
    log = simulate(scenario)
    mpl.rcParams |= {"svg.hashsalt": "climb", "svg.fonttype": "none", "font.size": 10}
    figure, ax = plt.subplots(figsize=(9.0, 4.6), layout="constrained")
    draw_ground(ax, scenario)
    draw_feet(ax, log, Biped.load(scenario.robot).soles["left"].half_size[0])
    draw_com(ax, log)
    ax.set(xlim=(FIRST, LAST), ylim=(-0.03, None), xlabel="x [m]", ylabel="z [m]", aspect="equal")
    ax.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(PAGE, metadata={"Date": None})


def draw_ground(ax: Axes, scenario: Scenario) -> None:
    """The ground, whose edges are steep."""
    x = np.arange(FIRST, LAST, 2e-3)
    ax.fill_between(x, -0.03, [scenario.terrain.height(place, 0.0) for place in x], color="0.85", linewidth=0)


def draw_feet(ax: Axes, log: RunLog, half: float) -> None:
    """Paths of the soles' centres, and the soles in the middle of each step in which they stand."""
    support, middle = log.element("gait_phase", "support"), log.element("gait_phase", "tick") == MIDDLE
    for side, stands, colour in zip(SIDES, (1.0, -1.0), (LEFT, RIGHT), strict=True):
        x, z = log.element("foot_state", f"{side}_x"), log.element("foot_state", f"{side}_z")
        ax.plot(x[::2], z[::2], color=colour, linewidth=1.2, label=f"{side} sole")
        rows = middle & (support == stands)
        ax.hlines(z[rows], x[rows] - half, x[rows] + half, color=colour, linewidth=3.0)


def draw_com(ax: Axes, log: RunLog) -> None:
    """The line under the CoM, and the CoM."""
    x, line = log.element("com_reference", "x"), log.element("ground_reference", "z")
    ax.plot(x[::4], line[::4], color=PLANNED_COM, linestyle=":", label="line under the CoM")
    ax.plot(x[::2], commanded_com_height(log)[::2], color=PLANNED_COM, linestyle="--", label="CoM as planned")
    measured = log.element("lip_state", "x"), log.element("com_z", "z")
    ax.plot(*(values[::2] for values in measured), color=MEASURED_COM, label="CoM as measured")


if __name__ == "__main__":
    main()
