"""How a pushed walk can end, and what counts as walking on: one definition for pushes and campaigns."""

from __future__ import annotations

from typing import Final

import numpy as np

from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.walking.config import GaitConfig

SURVIVED: Final = "survived"
LEGS: Final = "legs touched"
ASTRAY: Final = "did not walk on"
GAVE_UP: Final = "simulation gave up"

_SPEED_ERROR = 0.1  # [m/s]: mean over the last gait, against what the gait commands; more is not walking on


def walks_on(gait: GaitConfig, log: RunLog) -> bool:
    """Whether the last gait of a log went at the commanded mean velocity, and on the feet's own tracks.

    Of a walk that was to end, or of less than a gait, nothing of the kind can be asked.
    """
    if "lip_state" not in log or gait.walk_steps is not None or len(log) <= gait.ticks_per_gait:
        return True
    com = log["lip_state"][:, [0, 3]]
    velocity = (com[-1] - com[-1 - gait.ticks_per_gait]) / (gait.ticks_per_gait * gait.tick)
    commanded = [gait.stride / (gait.ticks_per_step * gait.tick), 0.0]
    return bool(np.abs(velocity - commanded).max() < _SPEED_ERROR)
