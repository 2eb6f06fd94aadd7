"""Draws h under a constant and under a periodic bound: `python docs/bound.py` writes bound.svg beside this file.

The speed is that of the template without a barrier over three steps of `vhip_nobarrier`; in the second one a push makes
it faster. Both bounds keep the same margin from the undisturbed walk: the constant one from its largest speed, the
periodic one from its speed at each tick.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from numpy.typing import NDArray

from pdhocbf_drake import load_scenario, simulate
from pdhocbf_drake.analysis.palette import MEASURED_COM, RUNS, SAFE, UNSAFE

Array = NDArray[np.float64]

PAGE: Final = Path(__file__).parent / "bound.svg"
MARGIN: Final = 0.01  # of both bounds [m/s]
WALK: Final = "{duration: 6.5}"
PUSHED: Final = "{duration: 6.5, pushes: [{time: 5.40, duration: 0.02, force: [30.0, 0.0, 0.0]}]}"
TICK, FIRST, LAST = 0.01, 480, 600  # [s], and three steps of the settled walk


def main() -> None:
    """Writes bound.svg."""
    walks = [simulate(load_scenario("vhip_nobarrier", text)) for text in (WALK, PUSHED)]
    steady, pushed = (walk.element("lip_state", "vx")[FIRST : LAST + 1] for walk in walks)
    bounds = {"A constant bound": np.full_like(steady, steady.max() + MARGIN), "A periodic bound": steady + MARGIN}
    mpl.rcParams |= {"svg.hashsalt": "bound", "svg.fonttype": "none", "font.size": 10}
    figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.2), sharey=True, layout="constrained")
    for ax, (name, bound) in zip(axes, bounds.items(), strict=True):
        draw(ax, name, bound, pushed)
    axes[0].set_ylabel("forward speed v [m/s]")
    figure.legend(*axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(PAGE, metadata={"Date": None})


def draw(ax: Axes, name: str, bound: Array, speed: Array) -> None:
    """One bound V̄, the speed v, h = V̄ − v between them, and where h < 0."""
    time = TICK * np.arange(len(speed))
    unsafe = speed > bound
    ax.fill_between(
        time, speed, bound, where=~unsafe, color=SAFE, interpolate=True, alpha=0.2, linewidth=0, label="h = V̄ − v ≥ 0"
    )
    ax.fill_between(
        time, speed, bound, where=unsafe, color=UNSAFE, interpolate=True, alpha=0.8, linewidth=0, label="h < 0"
    )
    ax.plot(time, bound, color=RUNS[0], linewidth=1.8, label="bound V̄")
    ax.plot(time, speed, color=MEASURED_COM, linewidth=1.4, label="speed v")
    pushed = time[int(np.argmax(np.diff(speed) > MARGIN))]
    foot = speed.min() - 0.004
    ax.annotate("push", (pushed, speed.min()), (pushed, foot), ha="center", va="top", arrowprops={"arrowstyle": "->"})
    ax.set_ylim(foot - 0.004, None)
    seen = f"the push shows as h < 0 at {unsafe.sum()} ticks" if unsafe.any() else "the push does not show"
    ax.set_title(f"{name}: {seen}", fontsize=10)
    ax.set_xlabel("time [s]")
    ax.spines[["top", "right"]].set_visible(False)


if __name__ == "__main__":
    main()
