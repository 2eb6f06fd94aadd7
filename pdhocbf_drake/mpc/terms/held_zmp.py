"""The moving ZMP box of a disturbed walk, cut to what the joints of the leg that stands hold."""

from __future__ import annotations

from functools import cache
from typing import ClassVar

import numpy as np

from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.terms.term import Setting, Tick
from pdhocbf_drake.mpc.terms.zmp_box import ZmpBox
from pdhocbf_drake.walking.sides import BOTH

_LEAST = 0.01  # length of what is left of the box, where less of it is held [m]


class HeldZmpBox(ZmpBox):
    """The rows of `ZmpBox` along x, cut at k + i, i = 1 … H, by how much of the box `mpc.limits.zmp_held` leaves out.

    Nothing is cut in double support and in a stand.

    Parameters: half, as of `ZmpBox`; cut_behind, cut_ahead, (H,) each [m].
    """

    cuts: ClassVar = {"zmp_box_lower": "cut_behind", "zmp_box_upper": "cut_ahead"}

    def __init__(self, setting: Setting) -> None:
        super().__init__(setting)
        limits, region = setting.config.plan_limits, setting.gait.region
        self._held = np.array([] if limits is None else limits.zmp_held)
        horizon, footholds = setting.config.horizon, setting.config.horizon // setting.gait.period
        self._weights = cache(lambda phase: region.weights(phase, horizon, footholds))

    @classmethod
    def configured(cls, config: MpcConfig) -> bool:
        return config.holds_zmp

    @property
    def sizes(self) -> dict[str, int]:
        return super().sizes | dict.fromkeys(self.cuts.values(), self.setting.config.horizon)

    def fill_tick(self, tick: Tick, theta: np.ndarray) -> None:
        if self.axis:
            return
        gait, weights, ahead = self.setting.gait, self._weights(tick.phase), tick.ahead
        steps, ticks = np.divmod(tick.phase + 1 + np.arange(len(weights)), gait.period)
        stands = np.array([step.side == BOTH for step in ahead.steps])
        half, shift = (0.0 if sides is None else weights @ sides[0] for sides in (ahead.half, ahead.shift))
        room = np.maximum(2.0 * half - _LEAST, 0.0)
        room *= (ticks >= gait.config.double_support_ticks) & ~stands[steps]
        low, high = self._held[ticks].T
        behind = np.clip(half - shift + low, 0.0, room)
        theta[self.places["cut_behind"]] = behind
        theta[self.places["cut_ahead"]] = np.clip(half + shift - high, 0.0, room - behind)
