"""The variable-height pendulum and its periodic divergent component."""

import pickle

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pdhocbf_drake.walking import CosineHeight, GaitConfig
from pdhocbf_drake.walking.divergent import DivergentComponent
from pdhocbf_drake.walking.vhip import Vhip

ETA = CosineHeight(GaitConfig(com_height_amplitude=0.015)).eta()
FLOWS = ("euler", "exact")


def test_euler_is_equation_23() -> None:
    vhip = Vhip(ETA, 0.01)
    c, v, p, u = 0.1, 0.3, 0.05, 0.7
    for k in (0, 13, 39, 40):
        eta = ETA[k % 40]
        expected = [c + 0.01 * v, v + 0.01 * eta * (c - p), p + 0.01 * u]
        np.testing.assert_allclose(vhip.step(k, np.array([c, v, p]), u), expected, rtol=1e-14)


def test_exact_flow_agrees_with_an_integrator() -> None:
    vhip, start, u = Vhip(ETA, 0.05, "exact"), np.array([0.1, 0.3, 0.05]), 0.7

    def flow(_: float, s: np.ndarray) -> list[float]:
        return [s[1], ETA[3] * (s[0] - s[2]), u]

    found = solve_ivp(flow, (0.0, 0.05), start, rtol=1e-12, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(vhip.step(3, start, u), found, atol=1e-10)


def test_euler_converges_to_the_exact_flow() -> None:
    errors = []
    for tick in (0.02, 0.01, 0.005):
        pair = [Vhip(np.full(4, 16.9), tick, flow).A[0] for flow in FLOWS]
        errors.append(np.abs(pair[0] - pair[1]).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize("flow", FLOWS)
def test_both_axes_step_as_each_by_itself(flow: str) -> None:
    vhip, random = Vhip(ETA, 0.01, flow), np.random.default_rng(0)
    for tick in (0, 3, len(ETA) + 5):
        state, velocity = random.normal(size=(2, 3)), random.normal(size=2)
        expected = [vhip.step(tick, state[axis], velocity[axis]) for axis in range(2)]
        np.testing.assert_allclose(vhip.step_axes(tick, state, velocity), expected, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("flow", FLOWS)
def test_prediction_is_the_repeated_step(flow: str) -> None:
    vhip = Vhip(ETA, 0.01, flow)
    random = np.random.default_rng(1)
    inputs, state = random.standard_normal(60), random.standard_normal(3)
    phi, gamma = vhip.prediction(25, 60)
    walked = state
    for i in range(61):
        np.testing.assert_allclose(phi[i] @ state + gamma[i] @ inputs, walked, atol=1e-10)
        if i < 60:
            walked = vhip.step(25 + i, walked, inputs[i])


@pytest.mark.parametrize("flow", FLOWS)
def test_floquet_relations(flow: str) -> None:
    vhip = Vhip(ETA, 0.01, flow)
    divergent = DivergentComponent(vhip)
    rows = np.array([[1.0, 1.0 / omega] for omega in divergent.omega])
    for k in range(40):
        following = rows[(k + 1) % 40]
        np.testing.assert_allclose(following @ vhip.A[k, :2, :2], divergent.growth[k] * rows[k], rtol=1e-12)
    cycle = np.eye(2)
    for matrix in vhip.A[:, :2, :2]:
        cycle = matrix @ cycle
    assert np.prod(divergent.growth) == pytest.approx(np.abs(np.linalg.eigvals(cycle)).max(), rel=1e-12)


def test_constant_eta_recovers_equation_30() -> None:
    euler = DivergentComponent(Vhip(np.full(8, 16.9), 0.01))
    np.testing.assert_allclose(euler.omega, np.sqrt(16.9), rtol=1e-12)
    np.testing.assert_allclose(euler.growth, 1.0 + np.sqrt(16.9) * 0.01, rtol=1e-12)
    exact = DivergentComponent(Vhip(np.full(8, 16.9), 0.01, "exact"))
    np.testing.assert_allclose(exact.growth, np.exp(np.sqrt(16.9) * 0.01), rtol=1e-12)
    np.testing.assert_allclose(exact.gain, (exact.growth - 1.0) / np.sqrt(16.9), rtol=1e-9)


def test_equation_30_with_a_constant_omega_is_not_invariant_when_eta_varies() -> None:
    vhip = Vhip(ETA, 0.01)
    row = np.array([1.0, 1.0 / np.sqrt(ETA.mean())])
    turned = row @ vhip.A[0, :2, :2]
    assert abs(turned[0] * row[1] - turned[1] * row[0]) > 1e-4


@pytest.mark.parametrize("flow", FLOWS)
def test_offset_follows_its_own_dynamics_and_its_input_weights(flow: str) -> None:
    vhip = Vhip(ETA, 0.01, flow)
    divergent = DivergentComponent(vhip)
    random = np.random.default_rng(2)
    state, inputs, start = random.standard_normal(3), random.standard_normal(100), 17
    first = divergent.offset_row(start) @ state
    offset = first
    for i, u in enumerate(inputs):
        state = vhip.step(start + i, state, u)
        phase = (start + i) % 40
        offset = divergent.growth[phase] * offset - divergent.gain[phase] * u
        assert divergent.offset_row(start + i + 1) @ state == pytest.approx(offset, rel=1e-9, abs=1e-9)
    rest = divergent.discounts(start, 100)[-1] * offset
    assert divergent.input_weights(start, 100) @ inputs + rest == pytest.approx(first, rel=1e-10)


def test_periodic_tail_is_brute_force_repetition_of_the_input() -> None:
    """The row of Lemma 2: with the inputs repeating forever, the offset that stays bounded is the periodic one."""
    vhip = Vhip(ETA, 0.01)
    divergent = DivergentComponent(vhip)
    inputs = np.random.default_rng(3).standard_normal(80)
    forever = np.tile(inputs, 40)
    brute = divergent.input_weights(5, len(forever)) @ forever
    closed = divergent.input_weights(5, 80) @ inputs / (1.0 - divergent.discounts(5, 80)[-1])
    assert closed == pytest.approx(brute, rel=1e-12)
    offset = closed
    for i, u in enumerate(inputs):
        phase = (5 + i) % 40
        offset = divergent.growth[phase] * offset - divergent.gain[phase] * u
    assert offset == pytest.approx(closed, rel=1e-9)


def test_a_prediction_is_kept_and_can_be_copied_with_the_pendulum_but_not_changed() -> None:
    vhip = Vhip(ETA, 0.01)
    phi, gamma = vhip.prediction(13, 60)
    with pytest.raises(ValueError, match="read-only"):
        phi[0, 0, 0] = 2.0
    with pytest.raises(ValueError, match="read-only"):
        gamma[0, 0, 0] = 2.0
    again = pickle.loads(pickle.dumps(vhip))
    for kept, told in zip((phi, gamma), again.prediction(13, 60), strict=True):
        np.testing.assert_array_equal(kept, told)
