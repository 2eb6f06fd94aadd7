"""The relative degree depends on the input, and is computed for each phase."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.barriers import (
    AffineBarrier,
    Barrier,
    PeriodicAffineSystem,
    check_in_safe_set,
    check_relative_degree,
    constant,
    in_safe_set,
    initial_psi,
    psi,
    relative_degree,
    tabulated,
)
from pdhocbf_drake.errors import InputError

TICK = 0.01
ETA = 9.81 / 0.58 * (1 + 0.05 * np.cos(2 * np.pi * np.arange(8) / 8))  # [1/s²], eight phases are enough here


def vhip_velocity_input():
    """Eq. (23) with the ZMP's velocity as input: states c, v, p."""
    A = np.array([[[1, TICK, 0], [eta * TICK, 1, -eta * TICK], [0, 0, 1]] for eta in ETA])
    return PeriodicAffineSystem(A, [[0.0], [0.0], [TICK]])


def vhip_position_input():
    """Eq. (23) as printed, the ZMP's position as input: states c, v."""
    A = np.array([[[1, TICK], [eta * TICK, 1]] for eta in ETA])
    return PeriodicAffineSystem(A, np.array([[[0.0], [-eta * TICK]] for eta in ETA]))


class Stepping:
    """The same dynamics without their matrices, which leaves differentiation only."""

    def __init__(self, system):
        self._system = system
        self.period, self.n, self.m = system.period, system.n, system.m

    def step(self, k, x, u):
        return self._system.step(k, x, u)


def velocity_barrier(n, gamma, relative_degree=None):
    return AffineBarrier("vx", np.eye(n)[1], constant(0.5), 1, gamma, "m/s", relative_degree)


@pytest.mark.parametrize("as_nonlinear", [False, True])
def test_vhip_velocity_has_degree_two_under_zmp_velocity_and_one_under_zmp_position(as_nonlinear):
    wrap = Stepping if as_nonlinear else (lambda system: system)
    assert check_relative_degree(velocity_barrier(3, (0.5, 0.5)), wrap(vhip_velocity_input())) == (2,) * 8
    assert check_relative_degree(velocity_barrier(2, (0.5,)), wrap(vhip_position_input())) == (1,) * 8
    # the CoM's position is a tick further away, the ZMP's own position a tick nearer
    for axis, degree in ((0, 3), (2, 1)):
        barrier = AffineBarrier("b", np.eye(3)[axis], constant(0.5), 1, (0.5,))
        assert relative_degree(barrier, wrap(vhip_velocity_input()), 5) == degree


@pytest.mark.parametrize("as_nonlinear", [False, True])
def test_a_wrong_declaration_names_the_declared_and_the_computed_one(as_nonlinear):
    system = vhip_velocity_input()
    with pytest.raises(InputError) as caught:
        check_relative_degree(velocity_barrier(3, (0.5,)), Stepping(system) if as_nonlinear else system)
    assert str(caught.value) == (
        'barrier "vx": relative degree 1 is declared by 1 class-K function, but the dynamics give 2 (at every phase)'
    )
    # ψ_1 with the true degree declared is the usable form: enforced from the second tick on
    check_relative_degree(velocity_barrier(3, (0.5,), relative_degree=2), system)


def test_degree_per_phase():
    """An input that is switched off in one phase reaches x_2 only in the others."""
    system = PeriodicAffineSystem([[1.0, 0.1], [0.0, 1.0]], [[[0.0], [1.0]], [[0.5], [1.0]], [[0.0], [0.0]]])
    barrier = AffineBarrier("x1", [1.0, 0.0], constant(1.0), 1, (0.5, 0.5))
    assert [relative_degree(barrier, system, phase) for phase in range(4)] == [2, 1, None, 2]
    with pytest.raises(InputError) as caught:
        check_relative_degree(barrier, system)
    assert str(caught.value) == (
        'barrier "x1": relative degree 2 is declared by 2 class-K functions, but the dynamics give 1 (at phase 1)'
    )


@pytest.mark.parametrize("as_nonlinear", [False, True])
def test_degree_follows_the_matrices_of_the_coming_ticks(as_nonlinear):
    """x_2 reaches x_1 only through A_1: u(0) shows two ticks later, u(1) has to wait a tick longer."""
    coupled, apart = [[1.0, 0.5], [0.0, 1.0]], [[1.0, 0.0], [0.0, 1.0]]
    system = PeriodicAffineSystem(np.array([apart, coupled]), [[0.0], [1.0]])
    barrier = AffineBarrier("x1", [1.0, 0.0], constant(1.0), 1, (0.5, 0.5))
    given = Stepping(system) if as_nonlinear else system
    assert [relative_degree(barrier, given, phase) for phase in range(4)] == [2, 3, 2, 3]


def test_an_input_without_effect_on_h():
    system = PeriodicAffineSystem([[1.0, 0.0], [0.3, 1.0]], [[0.0], [1.0]])
    barrier = AffineBarrier("x1", [1.0, 0.0], constant(1.0), 1, (0.5,))
    with pytest.raises(InputError) as caught:
        check_relative_degree(barrier, system)
    assert str(caught.value) == (
        'barrier "x1": relative degree 1 is declared by 1 class-K function, but the input never shows in h '
        "(at every phase)"
    )
    assert relative_degree(barrier, Stepping(system), 0) is None


def test_cancellation_is_not_mistaken_for_a_relation():
    """n·B = 0.1·3 − 0.3·1 is 5e-17 in floating point: no degree 1."""
    system = PeriodicAffineSystem([[1.0, 0.2], [0.0, 1.0]], [[3.0], [-1.0]])
    assert 0.1 * 3 - 0.3 != 0
    assert relative_degree(AffineBarrier("b", [0.1, 0.3], constant(1.0), 1, (0.5,)), system, 0) == 2


class Pendulum:
    """θ⁺ = θ + δω, ω⁺ = ω + δ(−10 sin θ + u)."""

    period, n, m = 1, 2, 1

    def step(self, k, x, u):
        return np.array([x[0] + 0.02 * x[1], x[1] + 0.02 * (-10 * np.sin(x[0]) + u[0])])


def test_pendulum_by_differentiation():
    angle = Barrier("angle", lambda k, x: 1.0 - x[0] ** 2, 3, (0.5, 0.5))
    rate = Barrier("rate", lambda k, x: np.cos(x[0]) - 0.3 * x[1] ** 2, 1, (0.5,))
    assert check_relative_degree(angle, Pendulum()) == (2, 2, 2)
    assert check_relative_degree(rate, Pendulum()) == (1,)


@pytest.mark.parametrize("states", [[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]]])
def test_the_relative_degree_is_the_least_one_over_the_sampled_states(states):
    """h = x_1 x_2 on a double integrator: u(k) shows in h(k+1) = x_1⁺ x_2⁺, except where x_1⁺ is zero."""
    system = PeriodicAffineSystem([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]])
    product = Barrier("product", lambda k, x: x[0] * x[1], 1, (0.5,))
    assert relative_degree(product, system, 0, [[0.0, 0.0]]) == 2
    assert relative_degree(product, system, 0, states) == 1


def test_functions_that_cannot_be_differentiated_are_named():
    import math

    barrier = Barrier("angle", lambda k, x: math.sin(x[0]), 1, (0.5, 0.5))
    with pytest.raises(InputError, match=r'^barrier "angle": the dynamics or h cannot take AutoDiffXd \(.*\); '
                       r"write them with operators and NumPy functions$"):  # fmt: skip
        check_relative_degree(barrier, Pendulum())


def test_the_safe_set_needs_every_psi_below_m():
    system = vhip_velocity_input()
    barrier = velocity_barrier(3, (0.5, 0.5))
    slow, fast = np.array([0.0, 0.4, 0.0]), np.array([0.5, 0.49, 0.0])
    assert in_safe_set(barrier, system, 0, slow)
    # h = 0.01 ≥ 0, but the CoM is ahead of the ZMP and will be accelerated over the bound
    values = initial_psi(barrier, system, 0, fast)
    assert list(values) == ["psi_0", "psi_1"]
    assert list(values.values()) == pytest.approx(psi(barrier, system, 0, fast, [])[:2])
    assert values["psi_1"] == pytest.approx(-ETA[0] * TICK * 0.5 + 0.5 * 0.01)
    assert not in_safe_set(barrier, system, 0, fast)
    with pytest.raises(InputError) as caught:
        check_in_safe_set(barrier, system, 8, fast)
    assert str(caught.value) == (
        f'barrier "vx": the state at tick 8 is outside the safe set: psi_1 is {values["psi_1"]:.6g} m/s, '
        "but at least 0 is needed"
    )
    with pytest.raises(InputError, match="psi_0 is nan m/s"):
        check_in_safe_set(barrier, system, 0, np.array([0.0, np.nan, 0.0]))


def test_the_safe_set_moves_with_the_bound():
    """A state that stands still under a bound that falls: inside at tick 1, and no longer where ψ_1 sees the fall."""
    system = PeriodicAffineSystem([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]])
    barrier = AffineBarrier("x1", [1.0, 0.0], tabulated([1.0, 1.0, 1.0, 0.3]), 1, (0.5, 0.5))
    for k in range(8):
        values = list(initial_psi(barrier, system, k, [0.2, 0.0]).values())
        assert values == pytest.approx(psi(barrier, system, k, [0.2, 0.0], [])[:2], abs=1e-15)
        assert in_safe_set(barrier, system, k, [0.2, 0.0]) == (k % 4 != 2)


def test_the_edge_belongs_to_the_safe_set():
    system = PeriodicAffineSystem([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]])
    barrier = AffineBarrier("x1", [1.0, 0.0], constant(1.0), 1, (0.5, 0.5))
    assert initial_psi(barrier, system, 0, [1.0, 0.0]) == {"psi_0": 0.0, "psi_1": 0.0}
    assert in_safe_set(barrier, system, 0, [1.0, 0.0])
    check_in_safe_set(barrier, system, 0, [1.0, 0.0])


def test_psi_that_no_input_reaches_belongs_to_the_safe_set():
    """ψ_1 with relative degree 2: ψ_1(0) cannot be enforced, so it has to hold; with 3, ψ_1(1) too."""
    system = vhip_velocity_input()
    fast = np.array([0.5, 0.49, 0.0])
    late = velocity_barrier(3, (0.5,), relative_degree=2)
    assert list(initial_psi(late, system, 0, fast)) == ["psi_0", "psi_1"]
    assert not in_safe_set(late, system, 0, fast)
    position = AffineBarrier("c", [1.0, 0.0, 0.0], constant(0.5), 1, (0.01,), "m", 3)
    values = initial_psi(position, system, 0, [0.49, 0.0, 0.0])
    assert list(values) == ["psi_0", "psi_1", "psi_1, 1 tick later,"]
    assert values["psi_1, 1 tick later,"] < 0 < values["psi_1"]
