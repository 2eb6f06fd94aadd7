"""The Van der Pol oscillator (15)–(16), and periodic orbits as centres of a tube."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.trajectories import PiecewisePolynomial

from pdhocbf_drake.barriers.checks import finite_number, finite_vector, whole_ticks
from pdhocbf_drake.errors import InputError


class VanDerPol:
    """x₁⁺ = x₁ + δ x₂,  x₂⁺ = x₂ + δ (β x₂ − x₁ − β x₁² x₂ + u), eq. (16).

    With β = 0 and u = 0, Euler multiplies the amplitude by (1+δ²)^{1/2} a tick (3.2 % per revolution at δ = 0.01).
    So eq. (17) is no trajectory, and only an input keeps the amplitude.

    Attributes:
        beta: β [1].
        tick: δ [s].
        period, n, m: 1 tick (the dynamics do not depend on k), 2 states [1, 1/s], 1 input [1/s²].

    Raises:
        InputError: β is negative or not finite, or δ is not positive and finite.
    """

    period = 1
    n = 2
    m = 1

    def __init__(self, beta: float, tick: float) -> None:
        self.beta = finite_number("Van der Pol: beta", beta, 0.0)
        self.tick = _positive_tick(tick)

    def drift(self, x: NDArray[Any]) -> Any:
        """β x₂ − x₁ − β x₁² x₂ [1/s²], the acceleration without input."""
        return self.beta * (1 - x[0] * x[0]) * x[1] - x[0]

    def step(self, k: int, x: NDArray[Any], u: NDArray[Any]) -> NDArray[Any]:
        """x(k+1), eq. (16); floats or AutoDiffXd."""
        return np.array([x[0] + self.tick * x[1], x[1] + self.tick * (self.drift(x) + u[0])])


def orbit_through(positions: ArrayLike, tick: float) -> NDArray[np.float64]:
    """The orbit (N, 2) of eq. (16) with x₁(k) = positions[k]: x₂(k) = (x₁(k+1) − x₁(k))/δ [1, 1/s].

    With these x₂ the first row of eq. (16) holds exactly, and some input makes the second one hold. The paper's
    pair of sampled harmonics misses the first row by δ²/2, so that tubes around x₁ and x₂ drift apart.

    Raises:
        InputError: the positions are not a list of finite numbers, or δ is not positive and finite.
    """
    x1 = finite_vector("Van der Pol: the positions of an orbit", positions, np.size(positions))
    return np.stack([x1, (np.roll(x1, -1) - x1) / _positive_tick(tick)], axis=1)


def harmonic_orbit(amplitude: float, period: int, tick: float) -> NDArray[np.float64]:
    """x₁(k) = amplitude·cos(2πk/N), eq. (17), (N, 2); N = `period` must be whole, and 2π/δ is not.

    Raises:
        InputError: as `orbit_through`; or N is not a whole number from 2 on.
    """
    period = whole_ticks("Van der Pol: the period of an orbit", period, 2)
    amplitude = finite_number("Van der Pol: the amplitude", amplitude)
    return orbit_through(amplitude * np.cos(2 * np.pi * np.arange(period) / period), tick)


def limit_cycle(system: VanDerPol, period: int) -> NDArray[np.float64]:
    """The oscillator's own orbit for β > 0, from its greatest x₁ on, stretched to N = `period` ticks, (N, 2).

    Raises:
        InputError: β = 0, which has no limit cycle; Euler diverges at this tick; or N is not a whole number from 2 on.
    """
    period = whole_ticks("Van der Pol: the period of an orbit", period, 2)
    if system.beta == 0:
        raise InputError("Van der Pol: beta = 0 has no limit cycle; a tube then follows the harmonic orbit")
    # A disturbance of the cycle decays like e^{-βt} or faster: after 30/β seconds nothing is left of the start.
    states = [np.array([2.0, 0.0])]
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(round(max(60.0, 30.0 / system.beta) / system.tick)):
            states.append(system.step(k, states[-1], np.zeros(1)))
    x1, x2 = np.array(states).T
    peaks = np.flatnonzero((x2[:-1] > 0) & (x2[1:] <= 0))
    if not np.all(np.isfinite(x1)) or len(peaks) < 3:
        problem = f"no limit cycle found at beta = {system.beta:g} with a tick of {system.tick:g} s"
        raise InputError(f"Van der Pol: {problem}")
    begin, end = (peaks + x2[peaks] / (x2[peaks] - x2[peaks + 1]))[-2:]  # where x₂ crosses zero [ticks]
    # A smooth curve, because the orbit's input depends on its second differences.
    span = np.arange(max(0, int(begin) - 10), len(x1))
    curve = PiecewisePolynomial.CubicWithContinuousSecondDerivatives(span.astype(float), x1[np.newaxis, span])
    ticks = np.linspace(begin, end, period, endpoint=False)
    return orbit_through([curve.value(t).item() for t in ticks], system.tick)


def _positive_tick(tick: float) -> float:
    if not finite_number("Van der Pol: the tick", tick) > 0:
        raise InputError(f"Van der Pol: the tick must be positive, given {tick}")
    return float(tick)
