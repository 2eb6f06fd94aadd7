"""The place and heading that the view of a walk's replay follows."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.analysis.heading import commanded_path
from pdhocbf_drake.simulation.run_folder import Run


def view_of(run: Run) -> np.ndarray:
    """Place and heading that the view follows at each row, (T, 3) [m, rad]: the mean over a gait.

    It is that of the CoM's x, and in a walk under commands also of its y and of the heading of the commanded path.
    """
    log, gait = run.log, run.scenario.gait
    view = np.zeros((len(log), 3))
    view[:, 0] = log.element("lip_state", "x")
    if "path" in log:
        view[:, 1] = log.element("lip_state", "y")
        view[:, 2] = commanded_path(log, gait.ticks_per_step, gait.tick)[:, 2]
    reach = gait.ticks_per_gait // 2
    window = np.full(2 * reach + 1, 1.0 / (2 * reach + 1))
    return np.column_stack([np.convolve(np.pad(c, reach, mode="edge"), window, mode="valid") for c in view.T])
