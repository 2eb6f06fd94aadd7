"""eta of the pendulum over uneven ground, without the rise being even or the ground being taken for level."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.walking.com_height import GRAVITY
from pdhocbf_drake.walking.com_line import ComLine
from pdhocbf_drake.walking.gait import Gait


class UnevenEta:
    """eta = (z̈ + g)/(z − z_zmp) at a tick and state, with z = z_com(k) + L(k, c) over `ComLine` L.

    On a plane of slope s, L̈ = s·c̈ depends on c̈ = eta (c − p): with q = w·s (c − p), D = z − z_zmp and G the rest of
    z̈ + g, z̈ + g = G D/(D − q). So eta is that of level ground on any plane.
    """

    def __init__(self, gait: Gait) -> None:
        self._gait, self._line = gait, ComLine(gait.period, gait.config.tick)

    def __call__(self, tick: int, state: np.ndarray) -> float:
        """eta [1/s²] at tick k with [c, v, p] per axis, (2, 3)."""
        gait = self._gait
        step, phase = gait.phase(tick)
        (c, v, p), planes = state.T, gait.planes(step)
        z, _, acceleration = gait.height(phase)
        over, _, rising = self._line(phase, planes, c, v, np.zeros(2))
        last, here, _ = planes[:, 0] + planes[:, 1:] @ p
        weight = gait.region.weight[phase]
        above = z + over - (1.0 - weight) * last - weight * here
        along = float(self._line.weights[phase, 0] @ planes[:, 1:] @ (c - p))
        return float((acceleration + rising + GRAVITY) / (above - along))
