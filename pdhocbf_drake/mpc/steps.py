"""What the gait commands over the horizon, as the parameters of one tick: targets, limits, box sizes, tail."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.divergent import DivergentComponent
from pdhocbf_drake.walking.footsteps import BOTH

_TAIL_HORIZONS = 4  # ticks beyond the horizon are discounted by e^{-ωδi}: after four horizons nothing is left


class StepParameters(NamedTuple):
    """Steps j + 1 … j + n_f as commanded; every array has the axes x, y first.

    Attributes:
        moves: from one step's centre to the next one's, shape (2, n_f) [m].
        lower, upper: limits of these moves, shape (2, n_f) [m].
        half: half sides of the box in steps j − 1 … j + n_f, less the margin, shape (2, n_f + 2) [m].
        centre: commanded centre of step j in the world, shape (2,) [m].
    """

    moves: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    half: np.ndarray
    centre: np.ndarray


class StepPreview:
    """Reads the gait ahead of a tick; every answer depends on the step index (and phase) alone and is kept."""

    def __init__(self, gait: Gait, config: MpcConfig, divergent: DivergentComponent) -> None:
        self._gait, self._config, self._divergent = gait, config, divergent
        self._count = config.horizon // gait.period
        self.steps = lru_cache(maxsize=4)(self._steps)
        self._tails = lru_cache(maxsize=4)(self._tails_of_step)

    def _steps(self, step: int) -> StepParameters:
        gait, config = self._gait, self._config
        seen = [gait.step(step + i) for i in range(-1, self._count + 1)]
        centres = np.array([[s.x, s.y] for s in seen]).T
        moves = np.diff(centres, axis=1)[:, 1:]
        lower, upper = moves.copy(), moves.copy()
        for i, (before, after) in enumerate(pairwise(seen[1:])):
            if BOTH in (before.side, after.side):
                continue  # a stand begins or ends where the feet are
            if config.step_reach is None:
                lower[:, i] -= config.step_tolerance
                upper[:, i] += config.step_tolerance
            else:
                lower[:, i], upper[:, i] = np.negative(config.step_reach), config.step_reach
            # The new stance foot stays on its own side of the old one, at least the minimum width away.
            if after.side > 0:
                lower[1, i] = max(lower[1, i], config.stance_width_min)
            else:
                upper[1, i] = min(upper[1, i], -config.stance_width_min)
        half = np.array([gait.region.half(s) for s in seen]).T - config.zmp_margin
        return StepParameters(moves, lower, upper, half, centres[:, 1])

    def repeats(self, step: int) -> bool:
        """True where this step and the one a horizon later both lie in the walk proper, so that a gait repeats."""
        return not self._gait.is_standing(step) and not self._gait.is_standing(step + self._count)

    def anticipative_tail(self, tick: int) -> np.ndarray:
        """Π λ⁻¹ e_{k+H} for a ZMP that follows the box centre beyond the horizon, per axis, shape (2,) [m]."""
        step, phase = divmod(tick, self._gait.period)
        return np.asarray(self._tails(step)[phase])

    def _tails_of_step(self, step: int) -> np.ndarray:
        gait, horizon = self._gait, self._config.horizon
        start = step * gait.period
        length = (1 + _TAIL_HORIZONS) * horizon + gait.period
        stances = np.array([gait.foothold(step + i) for i in range(-1, length // gait.period + 2)])
        centre = gait.region.centres(stances, length + 1)
        velocity = np.diff(centre, axis=0) / gait.config.tick
        tails = np.empty((gait.period, 2))
        for phase in range(gait.period):
            count = (1 + _TAIL_HORIZONS) * horizon
            weights = self._divergent.input_weights(start + phase, count)[horizon:]
            tails[phase] = weights @ velocity[phase + horizon : phase + count]
        return tails
