"""The Van der Pol oscillator (15)–(16): its orbits, its tube (18), and the growth of its amplitude under Euler."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff

from pdhocbf_drake.barriers import (
    AffineBarrier,
    BarrierFilter,
    PeriodicAffineSystem,
    check_relative_degree,
    feasible_width,
    in_safe_set,
    input_interval,
    record,
    tabulated,
)
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.oscillator.config import VanDerPolConfig
from pdhocbf_drake.oscillator.van_der_pol import VanDerPol, harmonic_orbit, limit_cycle
from pdhocbf_drake.oscillator.van_der_pol_tube import VanDerPolTube, joint_feasibility, tube_barriers

TICK = 0.01


@pytest.mark.parametrize("beta", [0.0, 0.7])
def test_step_is_euler_of_the_oscillator(beta):
    x, u = np.array([1.3, -0.4]), np.array([0.2])
    acceleration = beta * (1 - 1.3**2) * -0.4 - 1.3 + 0.2
    step = VanDerPol(beta, TICK).step(0, x, u)
    assert step == pytest.approx([1.3 - 0.4 * TICK, -0.4 + acceleration * TICK], abs=1e-15)


def test_step_differentiates():
    system, z = VanDerPol(0.7, TICK), np.array([1.3, -0.4, 0.2])
    gradient = ExtractGradient(system.step(0, *np.split(InitializeAutoDiff(z).ravel(), [2])))
    for i, e in enumerate(np.eye(3) * 1e-6):
        ahead, behind = (system.step(0, *np.split(z + s * e, [2])) for s in (1, -1))
        assert gradient[:, i] == pytest.approx((ahead - behind) / 2e-6, abs=1e-8)


def test_euler_multiplies_the_amplitude_each_tick():
    """β = 0, u = 0: |x(k)| = (1+δ²)^{k/2} |x(0)|; 3.2 % in 2π/δ ticks, which is not a whole number."""
    system, x = VanDerPol(0.0, TICK), np.array([0.6, 0.8])
    for k in range(1, 629):
        x = system.step(k, x, np.zeros(1))
        assert np.linalg.norm(x) == pytest.approx((1 + TICK**2) ** (k / 2), rel=1e-12)
    assert np.linalg.norm(x) == pytest.approx(1.032, abs=5e-4)
    assert (2 * np.pi / TICK) % 1 == pytest.approx(0.3185, abs=1e-4)


def _needed_input(system: VanDerPol, orbit: np.ndarray) -> np.ndarray:
    """The input that keeps the velocity on the orbit, (N,) [1/s²]."""
    free = np.array([system.step(k, x, np.zeros(1)) for k, x in enumerate(orbit)])
    return (np.roll(orbit[:, 1], -1) - free[:, 1]) / system.tick


@pytest.mark.parametrize("period", [628, 100])
def test_orbits_are_trajectories_under_their_input(period):
    system = VanDerPol(0.0, TICK)
    orbit = harmonic_orbit(1.5, period, TICK)
    assert orbit[:, 0].max() == pytest.approx(1.5)
    inputs = _needed_input(system, orbit)
    for k in range(period):
        assert system.step(k, orbit[k], inputs[k : k + 1]) == pytest.approx(orbit[(k + 1) % period], abs=1e-9)
    if period == 628:
        assert np.abs(inputs).max() < 0.02  # the natural period takes hardly any input


@pytest.mark.parametrize("beta", [0.1, 1.0])
def test_limit_cycle_takes_hardly_any_input_at_its_own_period(beta):
    """Its period is about 2π(1 + β²/16) [s], its amplitude about 2; and it attracts."""
    system = VanDerPol(beta, TICK)
    period = {0.1: 629, 1.0: 667}[beta]
    orbit = limit_cycle(system, period)
    assert orbit[0, 0] == pytest.approx(orbit[:, 0].max())
    assert orbit[0, 0] == pytest.approx(2.0, abs=0.15)
    assert np.abs(_needed_input(system, orbit)).max() < 0.1
    x = np.array([0.5, 0.0])
    for k in range(12000):
        x = system.step(k, x, np.zeros(1))
    assert np.linalg.norm(orbit - x, axis=1).min() < 0.03


def test_relative_degrees_of_the_four_barriers():
    tube = VanDerPolTube(VanDerPolConfig())
    assert [check_relative_degree(barrier, tube.system) for barrier in tube.barriers] == [(2,), (2,), (1,), (1,)]
    assert [barrier.name for barrier in tube.barriers] == ["x1_upper", "x1_lower", "x2_upper", "x2_lower"]
    for i, x in enumerate(tube.orbit[:5]):  # the orbit is the middle of the tube
        assert [barrier.h(i, x) for barrier in tube.barriers] == pytest.approx([0.1, 0.1, 0.1, 0.1])


@pytest.mark.parametrize(("beta", "period"), [(0.0, 628), (1.0, 667)])
def test_tube_holds_over_five_periods_without_a_reference(beta, period):
    start = (1.0, 0.0) if beta == 0 else tuple(float(s) for s in limit_cycle(VanDerPol(beta, TICK), period)[0])
    tube = VanDerPolTube(VanDerPolConfig(beta=beta, ticks_per_period=period, initial_state=start))
    run = tube.run(5 * period)
    assert {result.status for result in run.results} == {"solved"}
    for barrier in tube.barriers:
        assert record(barrier, run.states).h_min >= -1e-9
    # u = 0 most of the time: the filter only holds back what Euler's growth and drift would break
    assert np.mean(run.inputs == 0) > 0.5
    assert np.any(run.inputs != 0)
    if beta == 0:
        free = tube.run(5 * period, filtered=False)
        assert min(record(barrier, free.states).h_min for barrier in tube.barriers) < -0.02


def test_paper_pair_of_harmonics_is_no_orbit_of_the_first_row():
    """x₂ = −sin misses x₁(k+1) = x₁(k) + δx₂(k) by up to δ²/2; the forward difference does not."""
    theta = 2 * np.pi * np.arange(628) / 628
    miss = np.roll(np.cos(theta), -1) - np.cos(theta) + TICK * np.sin(theta)
    assert np.abs(miss).max() == pytest.approx(TICK**2 / 2, rel=0.02)
    orbit = harmonic_orbit(1.0, 628, TICK)
    assert np.abs(np.roll(orbit[:, 0], -1) - orbit[:, 0] - TICK * orbit[:, 1]).max() < 1e-15


@pytest.mark.parametrize(
    ("gamma_2", "feasible"), [(0.2, False), (0.249, False), (0.251, True), (0.5, True), (1.0, True)]
)
def test_joint_feasibility_needs_gamma_2_of_at_least_half_gamma_1(gamma_2, feasible):
    """γ_1 = 0.5. By hand: the width is (2γ_2 − γ_1)·(half width of x₂)/δ where x₁ may still move at full speed."""
    barriers = tube_barriers(harmonic_orbit(1.0, 20, TICK), (0.1, 0.1), (0.5, 0.5), (gamma_2,))
    worst = joint_feasibility(barriers, TICK)
    assert (worst.width >= 0) == feasible
    if gamma_2 < 0.5:
        assert worst.width == pytest.approx((2 * gamma_2 - 0.5) * 0.1 / TICK, abs=1e-6)


def test_joint_feasibility_is_that_of_the_worst_phase():
    """A tube of x₂ that narrows at one tick: the widths differ, and the least one counts."""
    orbit = harmonic_orbit(1.0, 20, TICK)
    upper, lower, *_ = tube_barriers(orbit, (0.1, 0.1), (0.5, 0.5), (0.3,))
    half = np.where(np.arange(20) == 7, 0.05, 0.1)
    speed = [
        AffineBarrier(f"x2{s:+}", [0.0, 1.0], tabulated(orbit[:, 1] + s * half), s, (0.3,), "1/s") for s in (1, -1)
    ]
    barriers = (upper, lower, *speed)
    integrator = PeriodicAffineSystem([[1.0, TICK], [0.0, 1.0]], [[0.0], [TICK]])
    widths = [feasible_width(integrator, barriers, k).width for k in range(20)]
    assert joint_feasibility(barriers, TICK).width == min(widths) < max(widths) - 0.1


@pytest.mark.parametrize("beta", [0.0, 1.0])
def test_the_width_does_not_depend_on_beta(beta):
    system = VanDerPol(beta, TICK)
    barriers = tube_barriers(harmonic_orbit(1.0, 20, TICK), (0.1, 0.1), (0.5, 0.5), (0.2,))
    worst = joint_feasibility(barriers, TICK)
    k = next(k for k in range(20) if all(b.h(k, worst.state) > -1e-9 for b in barriers))
    low, high = input_interval(system, barriers, k, worst.state)
    assert high - low == pytest.approx(worst.width, abs=1e-6)
    assert BarrierFilter(system, barriers)(k, worst.state, [0.0]).status == "softened"


def message(**keys):
    with pytest.raises(InputError) as caught:
        VanDerPolTube(VanDerPolConfig(**keys))
    return str(caught.value)


def test_errors_of_a_tube():
    assert message(gamma_1=(0.5, 0.5), gamma_2=(0.2,), ticks_per_period=20).startswith(
        "van_der_pol: the barriers x1_lower and x2_upper exclude each other by 1 1/s^2 of input near x = ("
    )
    assert message(initial_state=(1.2, 0.0)) == (
        'barrier "x1_upper": the state at tick 0 is outside the safe set: psi_0 is -0.1, but at least 0 is needed'
    )
    assert message(gamma_1=(0.5,)) == (
        'barrier "x1_upper": relative degree 1 is declared by 1 class-K function, but the dynamics give 2 '
        "(at every phase)"
    )
    assert message(gamma_2=(1.5,)).startswith("class-K rate gamma = 1.5 is outside (0, 1]")
    assert message(tube=(0.0, 0.1)) == "van_der_pol.tube: half widths must be positive, given 0.0"
    assert message(beta=50.0) == "Van der Pol: no limit cycle found at beta = 50 with a tick of 0.01 s"
    with pytest.raises(InputError, match="beta = 0 has no limit cycle"):
        limit_cycle(VanDerPol(0.0, TICK), 628)
    with pytest.raises(InputError, match="the tick must be positive, given 0"):
        VanDerPol(0.0, 0.0)


def test_the_start_must_be_in_every_psi_i():
    """Near the edge of x₁ and moving outwards: h ≥ 0, ψ_1 < 0."""
    tube = VanDerPolTube(VanDerPolConfig())
    x = np.array([1.0995, 0.09])
    upper = tube.barriers[0]
    assert upper.h(0, x) > 0
    assert not in_safe_set(upper, tube.system, 0, x)
