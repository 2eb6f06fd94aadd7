"""The predefined vertical CoM motion, eq. (24), and the eta of eq. (22) that it implies."""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking.config import GaitConfig

GRAVITY = 9.81  # [m/s²]


class CosineHeight:
    """z(k) = Z_com + Δ_z cos(2π (k − k₀)/N), eq. (24), with k₀ the tick of the step at which it is highest.

    eta(k) = (z̈(k) + g)/z(k) [1/s²], eq. (22). The derivatives are those of the continuous cosine.

    Raises:
        InputError: the height reaches the ground, or its downward acceleration reaches that of gravity.
    """

    def __init__(self, config: GaitConfig) -> None:
        self.nominal = config.com_height
        self.amplitude = config.com_height_amplitude
        self.period = config.ticks_per_step
        phase = config.com_height_phase
        self._phase = self.period / 2 if phase == "middle" else phase
        self._rate = 2.0 * math.pi / (self.period * config.tick)
        if self.amplitude >= self.nominal:
            raise InputError(
                f"gait.com_height_amplitude: must be below the CoM height {self.nominal} m (given: {self.amplitude})"
            )
        if self.amplitude * self._rate**2 >= GRAVITY:
            limit = GRAVITY / self._rate**2
            raise InputError(
                f"gait.com_height_amplitude: must be below {limit:.3g} m, where the CoM would fall freely at its top "
                f"in steps of {self.period * config.tick:g} s (given: {self.amplitude})"
            )

    def __call__(self, tick: int) -> tuple[float, float, float]:
        """z, ż, z̈ at a tick [m, m/s, m/s²]."""
        angle = 2.0 * math.pi * ((tick - self._phase) % self.period) / self.period
        swing = self.amplitude * math.cos(angle)
        rate = self._rate
        return self.nominal + swing, -self.amplitude * rate * math.sin(angle), -(rate**2) * swing

    def eta(self) -> np.ndarray:
        """eta over one step, shape (N,) [1/s²]."""
        heights = [self(tick) for tick in range(self.period)]
        return np.array([(az + GRAVITY) / z for z, _, az in heights])
