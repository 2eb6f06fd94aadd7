"""A Kalman filter on [c, v] of each axis, with the template as model: believed = predicted + K (measured − predicted).

Noise of a measured CoM goes one to one into the joints' targets; a robot falls from 5 mm of it where it stands. The
gain is steady, and another one, steady too, while the evidence of a push stands.
"""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.mpc.config import FilterConfig
from pdhocbf_drake.walking.vhip import Vhip

_KEPT = 0.8  # of the evidence from tick to tick: it is gathered over five ticks
_NOTICED = 4.5  # standard deviations of that evidence; noise alone exceeds them once in 150,000 ticks
_LEAST = 1e-6  # [m] and [m/s]: a measurement that is exact counts as this noisy


class CoMFilter:
    """K without a push and with one, for measurements that have been carried forward by d ticks.

    Where y is late, K is designed for tick k − d, where noise and model are known, and moved to tick k like the
    measurement is: K_d = Φ K Φ⁻¹, Φ = Aᵈ. It is the optimal gain for late measurements.

    Attributes:
        gain: K_d of a walk that is not pushed, (2, 2), from measured c and v to those believed.
        pushed_gain: K_d while a push is noticed.
        innovation: standard deviation of the measured divergent component less the predicted one [m].
    """

    def __init__(self, vhip: Vhip, config: FilterConfig, delay: int = 0) -> None:
        """
        Args:
            vhip: the template; the gain is that of its mean eta.
            config: noise of measurements and of the model.
            delay: d [ticks].
        """
        eta, tick = float(vhip.eta.mean()), vhip.tick
        A = Vhip(np.array([eta]), tick, vhip.flow).A[0][:2, :2]
        noise = np.diag(np.maximum([config.com, config.velocity], _LEAST) ** 2)
        moved = np.linalg.matrix_power(A, delay)
        gains = []
        for acceleration in (config.model, config.push):
            gain, spread = steady_gain(A, process_noise(tick, acceleration), noise)
            gains.append(moved @ gain @ np.linalg.inv(moved))
            if len(gains) == 1:
                seen = moved.T @ np.array([1.0, eta**-0.5])
                self.innovation = float(np.sqrt(seen @ spread @ seen))
        self.gain, self.pushed_gain = gains
        self._omega = eta**0.5

    def believed(self, predicted: np.ndarray, measured: np.ndarray, evidence: np.ndarray) -> np.ndarray:
        """Evidence of a push at this tick (2,) [1]; `measured` becomes what is believed.

        Args:
            predicted: c, v, p of x, then of y, as the last plan predicts it (2, 3).
            measured: likewise; written into.
            evidence: at the tick before (2,).
        """
        error = measured[:, :2] - predicted[:, :2]
        divergent = (error[:, 0] + error[:, 1] / self._omega) / self.innovation
        evidence = _KEPT * evidence + (1.0 - _KEPT**2) ** 0.5 * divergent
        # Both axes open together and by the length of the evidence: the same in every yawed frame.
        pushed = float(evidence @ evidence) > _NOTICED**2
        measured[:, :2] = predicted[:, :2] + error @ (self.pushed_gain if pushed else self.gain).T
        return np.asarray(evidence)


def process_noise(tick: float, acceleration: float) -> np.ndarray:
    """Covariance of [c, v] by an unknown acceleration a of that standard deviation over a tick δ (2, 2) [m, m/s].

    [δ²/2, δ] [δ²/2, δ]ᵀ a², and (a δ²)² of c alone: a position that jumps must be believed in the end.
    """
    by = np.array([tick**2 / 2.0, tick])
    return (np.outer(by, by) + np.diag([tick**4, 0.0])) * acceleration**2


def steady_gain(A: np.ndarray, process: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """K = P (P + R)⁻¹ of the stationary P = A (P − K P) Aᵀ + Q, and the innovations' covariance P + R (n, n).

    Args:
        A: x⁺ = A x + w (n, n). process: Q, covariance of w. noise: R, that of y = x + v.
    """
    from scipy.linalg import solve_discrete_are  # here, since scipy takes long to load

    P = solve_discrete_are(A.T, np.eye(len(A)), process, noise)
    return P @ np.linalg.inv(P + noise), P + noise
