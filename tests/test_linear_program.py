"""Small linear programs and the least width of a safe set, in any units."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from pdhocbf_drake.barriers import AffineBarrier, PeriodicAffineSystem, constant, feasible_width, harmonic
from pdhocbf_drake.barriers.linear_program import minimum
from pdhocbf_drake.oscillator.config import VanDerPolConfig
from pdhocbf_drake.oscillator.van_der_pol import harmonic_orbit
from pdhocbf_drake.oscillator.van_der_pol_tube import VanDerPolTube


def test_the_minimum_is_that_of_scipy_in_any_units():
    statuses = set()
    for seed in range(300):
        random = np.random.default_rng(seed)
        n, count = int(random.integers(1, 4)), int(random.integers(1, 9))
        cost, rows = random.normal(size=n + 1), random.normal(size=(count, n + 1))
        rows[:, 0] += 0.5
        expected = linprog(cost[1:], A_ub=-rows[:, 1:], b_ub=rows[:, 0], bounds=(None, None), method="highs")
        of_x, of_rows = 10.0 ** random.uniform(-9, 9, n), 10.0 ** random.uniform(-9, 9, count)
        units = np.append(1.0, 1.0 / of_x)
        found = minimum(cost * units, rows * units * of_rows[:, None])
        statuses.add(expected.status)
        if expected.status == 2:
            assert found is None
        elif expected.status == 3:
            assert found is not None
            assert found.value == -np.inf
        else:
            assert found is not None
            assert found.value == pytest.approx(cost[0] + expected.fun, rel=1e-8, abs=1e-8)
            assert np.all(rows @ np.append(1.0, found.point / of_x) >= -1e-8)
    assert statuses == {0, 2, 3}


@pytest.mark.parametrize("length", [1e-9, 1e-5, 1.0, 1e9])
def test_the_least_width_scales_with_the_lengths(length):
    system = PeriodicAffineSystem([[1.0, 0.1], [-0.1, 1.0]], [[0.0], [0.1]])

    def width(scale: float) -> float:
        barriers = [
            AffineBarrier("x1+", [1, 0], harmonic(scale, 0.1 * scale, 0.0, 9), 1, (0.5, 0.5)),
            AffineBarrier("x1-", [1, 0], constant(-scale), -1, (0.5, 0.5)),
            AffineBarrier("x2+", [0, 1], constant(2 * scale), 1, (0.7,)),
            AffineBarrier("x2-", [0, 1], constant(-2 * scale), -1, (0.7,)),
        ]
        return feasible_width(system, barriers, 0).width

    assert width(length) / length == pytest.approx(width(1.0), rel=1e-9)


@pytest.mark.parametrize("amplitude", [1e-9, 1e-6, 500.0])
def test_a_tube_scales_with_its_amplitude(amplitude):
    def run(scale: float):
        x1, x2 = harmonic_orbit(scale, 63, 0.1)[0].tolist()
        config = VanDerPolConfig(
            amplitude=scale, tube=(0.1 * scale, 0.1 * scale), initial_state=(x1, x2), ticks_per_period=63, tick=0.1
        )
        tube = VanDerPolTube(config)
        return tube.worst.width / scale, tube.run(80)

    (width, small), (expected, one) = run(amplitude), run(1.0)
    assert width == pytest.approx(expected, rel=1e-8)
    assert {result.status for result in small.results} == {"solved"}
    assert small.states / amplitude == pytest.approx(one.states, abs=1e-8)
