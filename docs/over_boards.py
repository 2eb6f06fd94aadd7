"""Draws a walk over boards that are on no map: `python docs/over_boards.py` writes over_boards.svg beside this file.

For each foot, the left one above, from the side: the boards under it, the path of the sole's centre as planned for
level ground and as measured, and the sole where it stands.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from pdhocbf_drake import load_scenario, simulate
from pdhocbf_drake.analysis.palette import LEFT, PLANNED_COM, RIGHT
from pdhocbf_drake.robot import SIDES, Biped
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario

PAGE: Final = Path(__file__).parent / "over_boards.svg"
TEXT: Final = (
    "duration: 5.2, ground: [{kind: boards, from: 0.6, to: 3.0, length: 0.3, amplitude: 0.02, seed: 6, known: false}]"
)
FIRST, LAST = 0.2, 1.6  # x that is drawn [m]
DEEPEST: Final = -0.03  # z [m]
MIDDLE: Final = 20  # tick of a step at which its stance foot is drawn


def main() -> None:
    """Writes over_boards.svg."""
    scenario = load_scenario("walking_nobarrier", TEXT)
    log, half = simulate(scenario), Biped.load(scenario.robot).soles["left"].half_size[0]
    mpl.rcParams |= {"svg.hashsalt": "over_boards", "svg.fonttype": "none", "font.size": 10}
    figure, axes = plt.subplots(2, 1, figsize=(9.0, 2.9), sharex=True, layout="constrained")
    for ax, side, stands, colour in zip(axes, SIDES, (1.0, -1.0), (LEFT, RIGHT), strict=True):
        draw_boards(ax, scenario, float(np.median(log.element("foot_state", f"{side}_y"))))
        draw_foot(ax, log, side, stands, half, colour)
        ax.set(xlim=(FIRST, LAST), ylim=(DEEPEST, 0.07), ylabel="z [m]", aspect="equal")
        ax.spines[["top", "right"]].set_visible(False)
    axes[1].set(xlabel="x [m]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(PAGE, metadata={"Date": None})


def draw_boards(ax: Axes, scenario: Scenario, y: float) -> None:
    """The true ground along x at y."""
    x = np.arange(FIRST, LAST, 2e-3)
    heights = [scenario.terrain.height(place, y, known=False) for place in x]
    ax.fill_between(x, DEEPEST, heights, color="0.85", linewidth=0)


def draw_foot(ax: Axes, log: RunLog, side: str, stands: float, half: float, colour: str) -> None:
    """The sole's path, and the sole in the middle of each step in which it stands."""
    x, z, pitch = (log.element("foot_state", f"{side}_{part}") for part in ("x", "z", "pitch"))
    planned = (log.element("foot_reference", f"{side}_{axis}") for axis in "xz")
    ax.plot(*(values[::2] for values in planned), color=PLANNED_COM, linestyle=":", label="sole as planned")
    ax.plot(x[::2], z[::2], color=colour, linewidth=1.2, label="as measured")
    rows = (log.element("gait_phase", "tick") == MIDDLE) & (log.element("gait_phase", "support") == stands)
    for place, height, angle in zip(x[rows], z[rows], pitch[rows], strict=True):
        ends = np.array([-half, half])
        ax.plot(place + ends * np.cos(angle), height - ends * np.sin(angle), color=colour, linewidth=3.0)


if __name__ == "__main__":
    main()
