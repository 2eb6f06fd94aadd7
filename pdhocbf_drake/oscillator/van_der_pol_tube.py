"""The Van der Pol oscillator held in a periodic tube by the four barriers (18), which share one input."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pdhocbf_drake.barriers import (
    AffineBarrier,
    BarrierFilter,
    FilterResult,
    PeriodicAffineSystem,
    WorstCase,
    check_in_safe_set,
    feasible_width,
    tabulated,
)
from pdhocbf_drake.barriers.checks import finite_array, finite_number, whole_ticks
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.oscillator.config import VanDerPolConfig
from pdhocbf_drake.oscillator.van_der_pol import VanDerPol, harmonic_orbit, limit_cycle

_ROUNDING = 1e-10  # of an interval's width, as a share of the terms that it is a difference of


class Run(NamedTuple):
    """A closed loop of T ticks.

    Attributes:
        states: x(0), …, x(T), (T+1, 2) [1, 1/s].
        inputs: (T,) [1/s²].
        results: the filter's result at each tick; empty without a filter.
    """

    states: NDArray[np.float64]
    inputs: NDArray[np.float64]
    results: list[FilterResult]


class VanDerPolTube:
    """h̄_i = x̄_i(k) − x_i and h̲_i = x_i − x̲_i(k), eq. (18), with x̄, x̲ = an orbit ± the half widths of a tube.

    The x₁ barriers have relative degree 2, the x₂ barriers 1. The filter's input is 0 unless a barrier needs another.

    Attributes:
        system: eq. (16).
        orbit: one period of the tube's centre, (N, 2) [1, 1/s].
        barriers: "x1_upper", "x1_lower", "x2_upper", "x2_lower".
        filter: returns the input nearest to a wanted one that satisfies all four.
        worst: the state at which they leave the narrowest interval of inputs, and its width.

    Raises:
        InputError: there are not two class-K slopes for x₁ and one for x₂ in (0, 1]; the barriers exclude each other
            at a state in the tube; or the initial state is outside the safe set.
    """

    def __init__(self, config: VanDerPolConfig) -> None:
        self.config = config
        self.system = VanDerPol(config.beta, config.tick)
        period = config.ticks_per_period
        if config.beta > 0:
            self.orbit = limit_cycle(self.system, period)
        else:
            self.orbit = harmonic_orbit(config.amplitude, period, config.tick)
        self.barriers = tube_barriers(self.orbit, config.tube, config.gamma_1, config.gamma_2)
        self.filter = BarrierFilter(self.system, self.barriers)  # checks the relative degrees
        self.worst = worst = joint_feasibility(self.barriers, config.tick)
        largest = np.abs(self.orbit).max(axis=0) + config.tube
        if worst.width < -_ROUNDING * max(largest / [config.tick**2, config.tick]):  # inputs that move x₁, x₂ so far
            raise InputError(
                f"van_der_pol: the barriers {worst.opponents[0]} and {worst.opponents[1]} exclude each other by "
                f"{-worst.width:.3g} 1/s^2 of input near x = ({worst.state[0]:.3g}, {worst.state[1]:.3g}): "
                f"raise gamma_2 to at least half of gamma_1[0]"
            )
        for barrier in self.barriers:
            check_in_safe_set(barrier, self.system, 0, config.initial_state)

    def run(self, ticks: int, filtered: bool = True, wanted: ArrayLike = 0.0) -> Run:
        """The closed loop from the initial state; if not `filtered`, the motion under the wanted input itself.

        Args:
            wanted: input that the filter starts from, one number or one for each tick, (ticks,) [1/s²].

        Raises:
            InputError: the length is not a whole number of ticks, at least 0; or the wanted input has another shape or
                is not finite.
        """
        length = whole_ticks("the length of a run", ticks, 0)
        targets = finite_array("the wanted input", wanted)
        if targets.shape not in ((), (length,)):
            raise InputError(f"the wanted input must have shape () or ({length},), given {targets.shape}")
        states, inputs, results = [np.array(self.config.initial_state)], [], []
        for k, u in enumerate(np.broadcast_to(targets, length).reshape(-1, 1)):
            if filtered:
                results.append(self.filter(k, states[-1], u))
                u = results[-1].input
            inputs.append(float(u[0]))
            states.append(self.system.step(k, states[-1], u))
        return Run(np.array(states), np.array(inputs), results)


def tube_barriers(
    orbit: NDArray[np.float64], tube: tuple[float, float], gamma_1: tuple[float, ...], gamma_2: tuple[float, ...]
) -> tuple[AffineBarrier, ...]:
    """The four barriers (18) around an orbit (N, 2) with half widths `tube` [1, 1/s].

    Raises:
        InputError: a half width is not positive.
    """
    barriers = []
    for i, (unit, gamma) in enumerate((("1", gamma_1), ("1/s", gamma_2))):
        if not finite_number("van_der_pol.tube", tube[i]) > 0:
            raise InputError(f"van_der_pol.tube: half widths must be positive, given {tube[i]}")
        for side, sign in (("upper", 1), ("lower", -1)):
            bound = tabulated(orbit[:, i] + sign * tube[i])
            barriers.append(AffineBarrier(f"x{i + 1}_{side}", np.eye(2)[i], bound, sign, gamma, unit))
    return tuple(barriers)


def joint_feasibility(barriers: tuple[AffineBarrier, ...], tick: float) -> WorstCase:
    """The least interval of inputs that all four barriers leave, over the whole tube and all phases [1/s²].

    Exact for any β: the input enters all four only through w = drift(x) + u, which shifts the interval but does not
    change its width; so the double integrator x₁⁺ = x₁ + δx₂, x₂⁺ = x₂ + δw has the same widths. Around an orbit of
    the first row it is ≥ 0 if gamma_2 ≥ gamma_1[0]/2, and only then unless the x₁ tube is very narrow.
    """
    integrator = PeriodicAffineSystem([[1.0, tick], [0.0, 1.0]], [[0.0], [tick]])
    widths = [feasible_width(integrator, barriers, k) for k in range(barriers[0].period)]
    return min(widths, key=lambda worst: float(f"{worst.width:.9g}"))  # the first of phases that differ by rounding
