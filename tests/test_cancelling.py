"""A constant disturbance: estimated, cancelled at the input, bounded, and left alone where nothing can be learned."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walks import make_mpc, start

from pdhocbf_drake.mpc.cancelling import estimated, lead
from pdhocbf_drake.mpc.config import DisturbanceConfig
from pdhocbf_drake.mpc.loop import Measurement, control, walk_template
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.sensed import sensed
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.walking.frame import rotation

CONFIG = DisturbanceConfig()
TICK, OLD = 0.01, 10_000
GAIT = {"ticks_per_step": 10, "double_support_ticks": 1, "stride": 0.02, "com_height_amplitude": 0.002}
MPC = {"horizon": 20, "freeze_ticks": 2, "disturbance": {}}
numbers = st.floats(-1e3, 1e3)


def settled(disturbance: np.ndarray, ticks: int, config: DisturbanceConfig = CONFIG, age: int = OLD) -> np.ndarray:
    """The estimate after so many ticks of a point mass under that acceleration, less what is cancelled."""
    w = np.zeros(4)
    for k in range(ticks):
        w = estimated(config, TICK, age + k, w, tuple(TICK * (disturbance - w[2:])), w[2:])
    return w


def test_a_constant_disturbance_is_estimated_and_cancelled_to_within_the_band() -> None:
    w = settled(np.array([0.3, -0.2]), 600)
    np.testing.assert_allclose(w[:2], [0.3, -0.2], atol=1e-3)
    assert np.hypot(*(w[2:] - w[:2])) <= CONFIG.width + 1e-12


def test_a_walk_that_begins_estimates_at_once() -> None:
    assert np.abs(settled(np.array([0.3, 0.0]), 40, age=0)[0] - 0.3) < 0.03
    assert np.abs(settled(np.array([0.3, 0.0]), 40)[0] - 0.3) > 0.1


def test_what_the_gait_itself_does_is_not_cancelled() -> None:
    w = np.zeros(4)
    for k in range(400):
        w = estimated(CONFIG, TICK, OLD + k, w, (TICK * 0.2 * np.sin(2 * np.pi * k / 40.0), 0.0), w[2:])
    assert np.abs(w[0]) < 0.06
    assert np.array_equal(w[2:], np.zeros(2))


def test_a_push_that_is_recovered_from_is_not_cancelled_and_a_steady_wind_is() -> None:
    w = np.zeros(4)
    for k in range(80):  # 100 N on 29 kg for 0.1 s, noticed in its second tick; what follows swings at 1 m/s²
        acceleration = 100.0 / 29.0 if k < 10 else np.sin(2 * np.pi * k / 40.0)
        w = estimated(CONFIG, TICK, OLD + k, w, (TICK * acceleration, 0.0), w[2:], disturbed=k > 1)
        assert np.array_equal(w[2:], np.zeros(2))
    for k in range(400):
        wind = tuple(TICK * (np.array([10.0 / 29.0, 0.0]) - w[2:]))
        w = estimated(CONFIG, TICK, OLD + k, w, wind, w[2:], disturbed=True)
    assert 0.15 < w[2] < 10.0 / 29.0


def test_what_is_cancelled_is_forgotten_where_nothing_disturbs() -> None:
    w = np.array([0.12, -0.05, 0.08, -0.03])
    for k in range(600):
        w = estimated(CONFIG, TICK, OLD + k, w, tuple(-TICK * w[2:]), w[2:])
    assert np.abs(w).max() < 1e-3


@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=30))
def test_estimate_and_its_rate_are_bounded_whatever_is_measured(errors: list[tuple[float, float]]) -> None:
    w = np.zeros(4)
    for k, error in enumerate(errors):
        after = estimated(CONFIG, TICK, OLD + k, w, error, w[2:])
        assert np.hypot(*(after - w)[:2]) <= CONFIG.rate * TICK + 1e-12
        assert np.hypot(*after[:2]) <= CONFIG.most + 1e-12
        assert np.hypot(*after[2:]) <= CONFIG.most + 1e-12
        w = after


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_an_error_that_is_no_number_changes_nothing(wrong: float) -> None:
    w = np.array([0.1, 0.2, 0.05, 0.2])
    assert np.array_equal(estimated(CONFIG, TICK, OLD, w, (wrong, 0.0), w[2:]), w)


@given(numbers, numbers, st.floats(-np.pi, np.pi))
def test_it_is_the_same_in_every_yawed_frame(x: float, y: float, yaw: float) -> None:
    w, turn = np.array([0.3, -0.1, 0.2, 0.0]), rotation(yaw)
    turned = np.concatenate([turn @ w[:2], turn @ w[2:]])
    straight = estimated(CONFIG, TICK, OLD, w, (x, y), w[2:])
    seen = estimated(CONFIG, TICK, OLD, turned, tuple(turn @ (x, y)), turned[2:])
    np.testing.assert_allclose(seen, np.concatenate([turn @ straight[:2], turn @ straight[2:]]), atol=1e-9)


def test_what_is_sent_takes_the_disturbance_off_and_keeps_the_zmp_in_its_box() -> None:
    mpc = make_mpc(GAIT, MPC)
    state, memory, wind = start(mpc).state, start(mpc), np.array([0.25, -0.15])
    for k in range(200):
        memory, _ = control(mpc, memory, Measurement(k, state))
        state = mpc.vhip.step_axes(k, state, memory.zmp_reference[1::2])
        state[:, 1] += TICK * wind
        eta = mpc.vhip.eta[(k + 1) % mpc.vhip.period]
        sent, com = memory.zmp_reference[::2], memory.com_reference.reshape(2, 3)
        np.testing.assert_allclose(sent, state[:, 2], atol=1e-9)  # the velocity that is sent leads where is sent
        np.testing.assert_allclose(com[:, 2], eta * (com[:, 0] - sent), atol=1e-9)
        low, high = memory.zmp_box.reshape(2, 2).T
        if k > 40:
            assert np.all(sent > low - 1e-6) and np.all(sent < high + 1e-6)
    np.testing.assert_allclose(memory.beliefs.input_disturbance[:2], wind, atol=0.02)


def test_a_missing_measurement_leaves_the_estimate() -> None:
    mpc = make_mpc(GAIT, MPC)
    kicks = np.tile([0.003, 0.0], (60, 1))
    (*_, last) = walk_template(mpc, start(mpc), 0, 60, kicks)
    memory, _ = control(mpc, last.memory, Measurement(60, np.full((2, 3), np.nan)))
    assert last.memory.beliefs.input_disturbance[0] > 0.1
    assert np.array_equal(memory.beliefs.input_disturbance, last.memory.beliefs.input_disturbance)


def test_a_lead_is_that_of_a_first_order_lag() -> None:
    assert lead(None, TICK) == 0.0
    follows = 1.0 - np.exp(-25.0 * TICK)
    assert 1.0 + lead(25.0, TICK) == pytest.approx(1.0 / follows)
    assert lead(1e4, TICK) < 1e-40


def test_wind_on_the_template_is_logged_and_walked_against() -> None:
    text = "{duration: 6.0, barriers: null, wind: [9.0, -6.0], mpc: {disturbance: {}}}"
    log = simulate(load_scenario("vhip_nobarrier", text.replace("barriers: null, ", "")))
    estimate = log["input_disturbance"]
    np.testing.assert_allclose(estimate[-1, :2], [0.3, -0.2], atol=0.02)
    gait = log["lip_state"][-1, 0] - log["lip_state"][-81, 0]
    assert gait == pytest.approx(0.3, abs=3e-3)


@pytest.mark.parametrize(
    ("measurement", "band"),
    [("{}", 0.05), ("{source: sensors}", 0.05), ("{source: sensors, encoders: {calibrated: null}}", 0.02),
     ("{source: sensors, encoders: {calibrated: null, offset: 0.001}}", 0.05)],
)  # fmt: skip
def test_the_band_is_narrow_where_encoders_are_not_calibrated(measurement: str, band: float) -> None:
    def found(mpc: str) -> float:
        disturbance = sensed(load_scenario("walking", f"{{measurement: {measurement}, mpc: {mpc}}}")).disturbance
        assert disturbance is not None
        return disturbance.width

    assert found("{}") == band
    assert found("{disturbance: {band: 0.04}}") == 0.04
