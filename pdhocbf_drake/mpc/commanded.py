"""The steps that a gait commands over the horizon."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.walking import Footstep, Gait
from pdhocbf_drake.walking.footsteps import BOTH


class Commanded(NamedTuple):
    """Steps j … j + n_f as commanded; every array has the axes x, y first.

    Attributes:
        steps: the gait's own, of j … j + n_f.
        moves: from one step's centre to the next one's, j + 1 … j + n_f, shape (2, n_f) [m].
        half: half sides of the box in steps j − 1 … j + n_f, less the margin, shape (2, n_f + 2) [m].
        centre: commanded centre of step j in the world, x and y [m].
        repeats: whether step j and step j + n_f both lie in the walk proper, so that a gait repeats.
    """

    steps: tuple[Footstep, ...]
    moves: np.ndarray
    half: np.ndarray
    centre: tuple[float, float]
    repeats: bool


class CommandedSteps:
    """Reads the gait ahead of a step, and keeps the last few answers.

    Args:
        margin: how far inside the box of the gait the ZMP is planned to stay [m].
    """

    def __init__(self, gait: Gait, horizon: int, margin: float) -> None:
        self._gait, self._margin, self._count = gait, margin, horizon // gait.period
        self.steps = lru_cache(maxsize=4)(self._steps)

    def _steps(self, step: int) -> Commanded:
        before, *ahead = (self._gait.step(step + i) for i in range(-1, self._count + 1))
        centres = np.array([[s.x, s.y] for s in ahead]).T
        half = np.array([self._gait.region.half(s) for s in (before, *ahead)]).T - self._margin
        repeats = BOTH not in (ahead[0].side, ahead[-1].side)
        return Commanded(tuple(ahead), np.diff(centres, axis=1), half, (ahead[0].x, ahead[0].y), repeats)
