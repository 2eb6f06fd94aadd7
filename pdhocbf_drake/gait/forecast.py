"""How the swing feet will be accelerated over the horizon."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.gait.gait import LEFT, Gait
from pdhocbf_drake.gait.swing import least_jerk


class SwingForecast:
    """Accelerations in x and y of whichever foot swings at the coming ticks, from where feet are and are to go."""

    def __init__(self, gait: Gait, horizon: int) -> None:
        config = gait.config
        self._gait, self._horizon = gait, horizon
        self._tick, self._lift_off = config.tick, config.double_support_ticks
        self._duration = gait.swing_ticks() * config.tick
        s = np.clip((np.arange(gait.period) - self._lift_off) / gait.swing_ticks(), 0.0, 1.0)
        # Of a swing by one metre from rest to rest, see `swing_point`, step after step.
        whole = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / self._duration**2
        self._whole = np.tile(whole, horizon // gait.period + 2)
        # 1, s, s², s³ at the ticks left of the step, for a swing that goes on from each tick of it.
        self._powers = []
        for phase in range(gait.period):
            ahead = np.arange(1, gait.period - phase)[:horizon] * self._tick / self._left(phase)
            self._powers.append(np.vander(ahead, 4, increasing=True).T.copy())

    def accelerations(
        self, phase: int, support: np.ndarray, now: np.ndarray, plan: np.ndarray, after: np.ndarray
    ) -> np.ndarray:
        """At k + 1 … k + H, shape (2, H) [m/s²].

        Args:
            phase: tick of the step at k.
            support: +1 left, −1 right, 0 both feet at k + 1 … k + H, shape (H,).
            now: position, velocity, acceleration of the left and right sole at k, shape (2, 3, 3).
            plan: where the left and right foot start and end this step, shape (2, 2, 2) [m].
            after: stance after the coming one, where the next step's swing ends, shape (2,) [m].
        """
        ahead = np.zeros((2, self._horizon))
        count = min(self._gait.period - 1 - phase, self._horizon)
        if count and support[0]:
            foot = 1 if support[0] == LEFT else 0
            ahead[:, :count] = self._this_step(phase, count, now[foot, :, :2], plan[foot])
        swings = support[count:]
        stands = np.flatnonzero(swings)
        if len(stands):
            foot = 1 if swings[stands[0]] == LEFT else 0
            whole = self._whole[phase + 1 + count : phase + 1 + self._horizon]
            ahead[:, count:] = (after - plan[foot, 1])[:, None] * (whole * np.abs(swings))
        return ahead

    def _left(self, phase: int) -> float:
        """What is left of a swing at a tick of the step [s]."""
        return self._duration - (phase - self._lift_off) * self._tick

    def _this_step(self, phase: int, count: int, now: np.ndarray, plan: np.ndarray) -> np.ndarray:
        start, end = plan
        if phase <= self._lift_off:
            return (end - start)[:, None] * self._whole[phase + 1 : phase + 1 + count]
        left = self._left(phase)
        _, _, a, third, fourth, fifth = least_jerk(now, end, left)
        terms = np.array([a, 6.0 * third, 12.0 * fourth, 20.0 * fifth]).T
        return (terms / left**2) @ self._powers[phase]
