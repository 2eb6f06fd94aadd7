"""The ground under the CoM: the stances' planes, averaged, so that the CoM rises evenly over a staircase."""

from __future__ import annotations

import numpy as np


class ComLine:
    """z = Σ_i w_i(k) plane_i(x, y) over the planes of the last, this and the next stance, at a place of the CoM.

    The weights are those of the steps in the stance staircase averaged over N ticks and then over N/2. Over a constant
    rise they make a straight line through each stance's height at its mid-step; on a plane the line is the plane, so
    that a CoM at constant height over it moves in parallel to a slope.

    A step from 0 to 1 at t = 0, averaged so, is r(t): r' is a trapezoid of area 1 from −3N/4 to 3N/4.

    Attributes:
        weights: w, w' and w'' at each tick of a step, (N, 3 derivatives, 3 steps) [1, 1/s, 1/s²].
    """

    def __init__(self, period: int, tick: float) -> None:
        ticks = np.arange(period, dtype=float)
        risen, coming = _averaged_step(ticks, period, tick), _averaged_step(ticks - period, period, tick)
        whole = np.zeros((3, period))
        whole[0] = 1.0
        self.weights = np.stack([whole - risen, risen - coming, coming], axis=2).transpose(1, 0, 2)

    def __call__(
        self, phase: int, planes: np.ndarray, com: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray
    ) -> tuple[float, float, float]:
        """z, ż and z̈ of the line [m, m/s, m/s²].

        Args:
            phase: tick of the step.
            planes: height at the origin, ∂z/∂x and ∂z/∂y of the last, this and the next stance's plane, (3, 3).
            com, velocity, acceleration: of the CoM along the ground, (2,) each [m, m/s, m/s²].
        """
        w, rate, change = self.weights[phase]
        height, slopes = planes[:, 0] + planes[:, 1:] @ com, planes[:, 1:]
        climbs = slopes @ velocity
        return (
            float(w @ height),
            float(rate @ height + w @ climbs),
            float(change @ height + 2.0 * rate @ climbs + w @ (slopes @ acceleration)),
        )


def _averaged_step(t: np.ndarray, period: int, tick: float) -> np.ndarray:
    """r, r' and r'' at ticks t, (3, len(t)) [1, 1/s, 1/s²]: the mean over N of that over N/2."""
    n, half = float(period), period / 2.0

    def ramp(s: np.ndarray) -> np.ndarray:  # integral of the integral of a step, N · N/2 times the part of r from it
        return np.asarray(0.5 * np.maximum(s, 0.0) ** 2)

    ends = [(0.75 * n, 1.0), (0.25 * n, -1.0), (-0.25 * n, -1.0), (-0.75 * n, 1.0)]
    r = sum(sign * ramp(t + end) for end, sign in ends) / (n * half)
    rate = sum(sign * np.maximum(t + end, 0.0) for end, sign in ends) / (n * half * tick)
    change = sum(sign * np.where(t + end > 0.0, 1.0, 0.0) for end, sign in ends) / (n * half * tick**2)
    return np.array([r, rate, change])
