"""The endings of a walk under test, and the criterion for walking on."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from pdhocbf_drake.analysis.heading import commanded_path
from pdhocbf_drake.simulation.run_log import FELL, FINISHED, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.walking.com_height import GRAVITY
from pdhocbf_drake.walking.config import GaitConfig

SURVIVED: Final = "survived"
LEGS_TOUCHED: Final = "legs touched"
DID_NOT_WALK_ON: Final = "did not walk on"
GAVE_UP: Final = "simulation gave up"

_SPEED_ERROR = 0.042  # largest error of the mean velocity over the last gait of a walk that goes on, over √(g z) [1]


def ending_of(scenario: Scenario, log: RunLog, sole_half: np.ndarray | None) -> str:
    """How a run ended: "survived", "fell", "legs touched", "did not walk on" or "simulation gave up".

    A run is survived if it lasts to its end, its soles never overlap in the view from above, and it walks at the
    commanded velocity during its last gait. On a template the soles play no part.

    Args:
        scenario: the scenario of the run.
        log: its log.
        sole_half: half length and half width of both soles, shape (2, 2) [m]; None on a template.
    """
    if log.ending == FELL:
        return FELL
    if log.ending != FINISHED:
        return GAVE_UP
    if sole_half is not None:
        poses = log["foot_state"].reshape(-1, 2, 6)[:, :, [0, 1, 5]]
        if any(soles_overlap(pose, sole_half) for pose in poses):
            return LEGS_TOUCHED
    return SURVIVED if walks_on(scenario.gait, log) else DID_NOT_WALK_ON


def walks_on(gait: GaitConfig, log: RunLog) -> bool:
    """Whether the mean velocity over the last gait of a log is the commanded one, in x and in y.

    Also true for a walk with a commanded end, and for a log shorter than a gait, from which it can't be judged.
    """
    if "lip_state" not in log or gait.walk_steps is not None or len(log) <= gait.ticks_per_gait:
        return True
    com = log["lip_state"][:, [0, 3]]
    velocity = (com[-1] - com[-1 - gait.ticks_per_gait]) / (gait.ticks_per_gait * gait.tick)
    commanded = np.array([gait.stride / (gait.ticks_per_step * gait.tick), 0.0])
    if "path" in log:
        path = commanded_path(log, gait.ticks_per_step, gait.tick, joined=True)[:, :2]
        commanded = (path[-1] - path[-1 - gait.ticks_per_gait]) / (gait.ticks_per_gait * gait.tick)
    return bool(np.abs(velocity - commanded).max() < _SPEED_ERROR * math.sqrt(GRAVITY * gait.com_height))


def soles_overlap(poses: np.ndarray, halves: np.ndarray) -> bool:
    """Whether two soles, rectangles in the view from above, overlap: whether no edge of either separates them.

    Poses that are not finite do.

    Args:
        poses: x, y, yaw of the left and right sole's centre, shape (2, 3) [m, rad].
        halves: half length and half width of each, shape (2, 2) [m].
    """
    left, right = poses.tolist()
    x, y, turn = (b - a for a, b in zip(left, right, strict=True))
    if not all(map(math.isfinite, (x, y, turn))):
        return True
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    (left_half, right_half) = halves.tolist()
    for yaw, (length, width), (other_length, other_width) in (
        (left[2], left_half, right_half), (right[2], right_half, left_half),
    ):  # fmt: skip
        ahead, aside = math.cos(yaw) * x + math.sin(yaw) * y, math.cos(yaw) * y - math.sin(yaw) * x
        if abs(ahead) >= length + c * other_length + s * other_width:
            return False
        if abs(aside) >= width + s * other_length + c * other_width:
            return False
    return True
