"""The variable-height inverted pendulum (22)–(23) with ZMP velocity as input (Remark 4)."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from pdhocbf_drake.barriers.checks import finite_array, finite_number, shown
from pdhocbf_drake.barriers.dynamics import PeriodicAffineSystem
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking.kernels import write_following, write_references

Flow = Literal["euler", "exact"]


class Vhip:
    """One axis of the VHIP: state s = [c, v, p] (CoM [m], CoM velocity [m/s], ZMP [m]), input u = ZMP velocity [m/s].

    Euler, as eq. (23):  c⁺ = c + δv,  v⁺ = v + δ eta_k (c − p),  p⁺ = p + δu.
    Exact: the flow of c̈ = eta_k (c − p), ṗ = u over a tick in which eta_k and u are constant.

    Attributes:
        A: state matrices over one period, shape (N, 3, 3).
        B: input columns, shape (N, 3).
        eta: (z̈ + g)/z over one period, shape (N,) [1/s²].
        tick: δ [s].
        system: the same dynamics in the form that `barriers` takes.

    Raises:
        InputError: eta is not a row of positive numbers, δ is not positive and finite, or the flow is unknown.
    """

    def __init__(self, eta: np.ndarray, tick: float, flow: Flow = "euler") -> None:
        self.eta = finite_array("eta", eta).copy()
        if self.eta.ndim != 1 or not self.eta.size or np.any(self.eta <= 0):
            raise InputError(f"eta: a row of positive numbers over one period is needed, given {shown(eta)}")
        if not finite_number("the tick of the pendulum", tick) > 0:
            raise InputError(f"the tick of the pendulum must be positive, given {tick}")
        if flow not in get_args(Flow):
            raise InputError(f"the flow of the pendulum is one of {', '.join(get_args(Flow))}, given {shown(flow)}")
        self.tick = tick
        self.flow = flow
        self.period = len(self.eta)
        make = _euler if flow == "euler" else _exact
        pairs = [make(value, tick) for value in self.eta]
        self.A = np.array([a for a, _ in pairs])
        self.B = np.array([b for _, b in pairs])
        self.system = PeriodicAffineSystem(self.A, self.B[:, :, None])
        self._eta: list[float] = self.eta.tolist()
        self._of_phase = [*zip(self.A, self.B, strict=True)]
        self._predictions: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def step(self, tick: int, state: np.ndarray, zmp_velocity: float) -> np.ndarray:
        """s(k + 1) from s(k), shape (3,)."""
        phase = tick % self.period
        return np.asarray(self.A[phase] @ state + self.B[phase] * zmp_velocity)

    def step_axes(self, tick: int, state: np.ndarray, zmp_velocity: np.ndarray) -> np.ndarray:
        """s(k + 1) of both axes from s(k), shape (2, 3), under ZMP velocities (2,) [m/s]."""
        phase, following = tick % self.period, np.empty((2, 3))
        write_following(*self._of_phase[phase], state, zmp_velocity, following)
        return following

    def references(self, tick: int, state: np.ndarray, zmp_velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`step_axes`; and x, ẋ, ẍ, y, ẏ, ÿ of the CoM and x, ẋ, y, ẏ of the ZMP at k + 1, shape (10,)."""
        phase, following, references = tick % self.period, np.empty((2, 3)), np.empty(10)
        eta = self._eta[(phase + 1) % self.period]
        A, B = self._of_phase[phase]
        write_references(A, B, eta, state, zmp_velocity, following, references)
        return following, references

    def prediction(self, tick: int, horizon: int) -> tuple[np.ndarray, np.ndarray]:
        """Φ (H + 1, 3, 3) and Γ (H + 1, 3, H), read-only, with s(k + i) = Φ_i s(k) + Γ_i [u(k), …, u(k + H − 1)]."""
        phase = tick % self.period
        if horizon not in self._predictions:
            self._predictions[horizon] = self._all_predictions(horizon)
        phi, gamma = self._predictions[horizon]
        return phi[phase], gamma[phase : phase + horizon + 1, :, phase : phase + horizon]

    def _all_predictions(self, horizon: int) -> tuple[np.ndarray, np.ndarray]:
        """Φ of every phase (N, H + 1, 3, 3), and one Γ (H + N, 3, H + N − 1) that has the Γ of each phase as a block.

        The effect of u(j) on s(i) depends on i and j alone, and not on where the plan begins.
        """
        phases, length = np.arange(self.period), horizon + self.period - 1
        phi = np.empty((self.period, horizon + 1, 3, 3))
        phi[:, 0] = np.eye(3)
        for i in range(horizon):
            phi[:, i + 1] = self.A[(phases + i) % self.period] @ phi[:, i]
        gamma = np.zeros((length + 1, 3, length))
        for i in range(length):
            phase = i % self.period
            gamma[i + 1, :, :i] = self.A[phase] @ gamma[i, :, :i]
            gamma[i + 1, :, i] = self.B[phase]
        for part in (phi, gamma):
            part.flags.writeable = False  # every call returns views of these arrays
        return phi, gamma


def _euler(eta: float, tick: float) -> tuple[np.ndarray, np.ndarray]:
    return (
        np.array([[1.0, tick, 0.0], [eta * tick, 1.0, -eta * tick], [0.0, 0.0, 1.0]]),
        np.array([0.0, 0.0, tick]),
    )


def _exact(eta: float, tick: float) -> tuple[np.ndarray, np.ndarray]:
    # c(t) = p + ut + (c − p) cosh ωt + (v − u)/ω sinh ωt with ω = √eta.
    omega = np.sqrt(eta)
    ch, sh = np.cosh(omega * tick), np.sinh(omega * tick)
    return (
        np.array([[ch, sh / omega, 1.0 - ch], [omega * sh, ch, -omega * sh], [0.0, 0.0, 1.0]]),
        np.array([tick - sh / omega, 1.0 - ch, tick]),
    )
