"""Whether a run was survived, read from its log."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.push.legs import soles_overlap
from pdhocbf_drake.simulation.run_log import FELL, FINISHED, RunLog
from pdhocbf_drake.simulation.scenario import Scenario

SURVIVED: Final = "survived"
LEGS: Final = "legs crossed"
ASTRAY: Final = "did not walk on"
GAVE_UP: Final = "simulation gave up"
_SPEED_ERROR = 0.1  # [m/s]: mean over the last gait, against what the gait commands


def verdict(scenario: Scenario, log: RunLog, sole_half: NDArray[np.float64] | None) -> str:
    """One of "survived", "fell", "legs crossed", "did not walk on", "simulation gave up".

    Survived is a run that lasts to its end, whose soles never share ground seen from above, and that walks at the
    commanded velocity again during its last gait. On a template, which has no legs, the first and last count.

    Args:
        sole_half: half length and half width of both soles, shape (2, 2) [m]; None on a template.
    """
    if log.ending == FELL:
        return FELL
    if log.ending != FINISHED:
        return GAVE_UP
    if sole_half is not None and _crossed(log, sole_half):
        return LEGS
    return SURVIVED if _walks_on(scenario, log) else ASTRAY


def _crossed(log: RunLog, sole_half: NDArray[np.float64]) -> bool:
    poses = log["foot_state"].reshape(-1, 2, 6)[:, :, [0, 1, 5]]
    return any(soles_overlap(pose, sole_half) for pose in poses)


def _walks_on(scenario: Scenario, log: RunLog) -> bool:
    gait = scenario.gait
    if "lip_state" not in log or gait.walk_steps is not None or len(log) <= gait.ticks_per_gait:
        return True  # it was not to walk on, or not for a whole gait
    lip = log["lip_state"][:, [0, 3]]
    velocity = (lip[-1] - lip[-1 - gait.ticks_per_gait]) / (gait.ticks_per_gait * gait.tick)
    commanded = [gait.stride / (gait.ticks_per_step * gait.tick), 0.0]
    return bool(np.abs(velocity - commanded).max() < _SPEED_ERROR)
