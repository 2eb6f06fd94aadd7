"""How the swing feet will be accelerated over the horizon."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.gait.gait import Gait
from pdhocbf_drake.gait.swing import least_jerk
from pdhocbf_drake.jit import compiled


class SwingForecast:
    """Accelerations in x and y of whichever foot swings at the coming ticks, from where feet are and are to go.

    Attributes:
        timing: what `swing_accelerations` needs of the gait: N and lift-off [ticks], duration of a swing and tick [s].
        whole: acceleration of a swing by one metre from rest to rest at each tick, see `swing_point`, step after step
            [1/s²].
    """

    def __init__(self, gait: Gait, horizon: int) -> None:
        tick, lift_off = gait.config.tick, gait.config.double_support_ticks
        duration = gait.swing_ticks() * tick
        s = np.clip((np.arange(gait.period) - lift_off) / gait.swing_ticks(), 0.0, 1.0)
        whole = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration**2
        self.whole = np.tile(whole, horizon // gait.period + 2)
        self.timing = (gait.period, lift_off, duration, tick)

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
        out = np.zeros((2, len(support)))
        add_swing_accelerations(self.timing, self.whole, phase, support, now, plan, after, (1.0, 1.0), np.inf, out)
        return out


@compiled
def add_swing_accelerations(
    timing: tuple[int, int, float, float], whole: np.ndarray, phase: int, support: np.ndarray, now: np.ndarray,
    plan: np.ndarray, after: np.ndarray, factor: tuple[float, float], most: float, out: np.ndarray,
) -> None:  # fmt: skip
    """Adds factor · acceleration, at most `most` of either sign, to `out` (2, H); see `SwingForecast.accelerations`."""
    period, lift_off, duration, tick = timing
    horizon = len(support)
    count = min(period - 1 - phase, horizon)  # ticks left of this step
    left = duration - (phase - lift_off) * tick  # and seconds of its swing
    coming = count
    while coming < horizon and support[coming] == 0.0:
        coming += 1
    for axis in range(2):
        if count and support[0] != 0.0:
            foot = 1 if support[0] > 0.0 else 0
            start, end = plan[foot, 0, axis], plan[foot, 1, axis]
            place, velocity, acceleration = now[foot, 0, axis], now[foot, 1, axis], now[foot, 2, axis]
            _, _, a, third, fourth, fifth = least_jerk(place, velocity, acceleration, end, left)
            for i in range(count):
                if phase <= lift_off:
                    value = (end - start) * whole[phase + 1 + i]
                else:
                    s = (i + 1) * tick / left
                    value = (a + s * (6.0 * third + s * (12.0 * fourth + s * 20.0 * fifth))) / left**2
                out[axis, i] += min(max(factor[axis] * value, -most), most)
        if coming < horizon:
            foot = 1 if support[coming] > 0.0 else 0
            way = after[axis] - plan[foot, 1, axis]
            for i in range(count, horizon):
                value = way * whole[phase + 1 + i] * abs(support[i])
                out[axis, i] += min(max(factor[axis] * value, -most), most)
