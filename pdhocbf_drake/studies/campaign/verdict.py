"""Whether a run was survived, read from its log."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.simulation.run_log import FELL, FINISHED, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.push.endings import ASTRAY, GAVE_UP, LEGS, SURVIVED, walks_on
from pdhocbf_drake.studies.push.legs import soles_overlap


def verdict(scenario: Scenario, log: RunLog, sole_half: NDArray[np.float64] | None) -> str:
    """One of "survived", "fell", "legs touched", "did not walk on", "simulation gave up".

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
    return SURVIVED if walks_on(scenario.gait, log) else ASTRAY


def _crossed(log: RunLog, sole_half: NDArray[np.float64]) -> bool:
    poses = log["foot_state"].reshape(-1, 2, 6)[:, :, [0, 1, 5]]
    return any(soles_overlap(pose, sole_half) for pose in poses)
