"""The periodic divergent component of motion: eq. (30) for an eta that varies over the step."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.walking.vhip import Vhip


class DivergentComponent:
    """ξ_k = c + v/ω_k and its offset from the ZMP, e_k = ξ_k − p_k, with e_{k+1} = λ_k e_k − g_k u_k.

    [1, 1/ω_k] is the unstable left Floquet vector of the (c, v) dynamics: [1, 1/ω_{k+1}] A_k = λ_k [1, 1/ω_k].
    For Euler: λ_k = 1 + eta_k δ/ω_{k+1}, 1/ω_k = (δ + 1/ω_{k+1})/λ_k, g_k = δ; for a constant eta ω = √eta, and
    (30) is recovered. The vector comes from one cycle's matrix and is then run backward around the cycle.

    Attributes:
        omega: ω over one period, shape (N,) [1/s].
        growth: λ over one period, shape (N,).
        gain: g over one period, shape (N,) [s].
    """

    def __init__(self, vhip: Vhip) -> None:
        self.period = vhip.period
        cycle = np.eye(2)
        for matrix in vhip.A[:, :2, :2]:
            cycle = matrix @ cycle
        values, vectors = np.linalg.eig(cycle.T)
        unstable = np.real(vectors[:, np.argmax(np.abs(values))])
        inverse = np.empty(self.period + 1)
        inverse[-1] = unstable[1] / unstable[0]
        growth = np.empty(self.period)
        for k in reversed(range(self.period)):
            row = np.array([1.0, inverse[k + 1]]) @ vhip.A[k, :2, :2]
            growth[k] = row[0]
            inverse[k] = row[1] / row[0]
        following = inverse[1:]
        self.omega = 1.0 / inverse[:-1]
        self.growth = growth
        self.gain = vhip.tick - (vhip.B[:, 0] + following * vhip.B[:, 1])

    def offset_row(self, tick: int) -> np.ndarray:
        """The row that gives e_k = row · [c, v, p], shape (3,)."""
        return np.array([1.0, 1.0 / self.omega[tick % self.period], -1.0])

    def discounts(self, tick: int, count: int) -> np.ndarray:
        """1/Π_{j ≤ i} λ_{k+j} for i = 0 … count − 1, shape (count,)."""
        phases = (tick + np.arange(count)) % self.period
        return 1.0 / np.cumprod(self.growth[phases])

    def input_weights(self, tick: int, count: int) -> np.ndarray:
        """Weights with e_k = Σ_{i < count} weight_i u_{k+i} + discount_{count−1} e_{k+count}, shape (count,) [s]."""
        phases = (tick + np.arange(count)) % self.period
        return self.gain[phases] * self.discounts(tick, count)
