"""How the swing feet will be accelerated over the horizon."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.walking.gait import Gait
from pdhocbf_drake.walking.swing import add_swing_accelerations


class SwingForecast:
    """Accelerations in x and y of whichever foot swings at the coming ticks, from where feet are and are to go.

    Attributes:
        timing: what `add_swing_accelerations` needs of the gait: N and lift-off [ticks], duration of a swing and tick
            [s].
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
