"""The filter before the MPC: Kalman's stationary gain, moved with late measurements, that opens for pushes."""

from __future__ import annotations

import numpy as np
import pytest
from walks import make_mpc, start

from pdhocbf_drake.mpc.config import FilterConfig
from pdhocbf_drake.mpc.filtering import CoMFilter, process_noise, steady_gain
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.sensed import sensed
from pdhocbf_drake.walking.frame import rotation
from pdhocbf_drake.walking.vhip import Vhip

TICK = 0.01
VHIP = Vhip(np.array([17.0]), TICK)
A = VHIP.A[0][:2, :2]
NOISE = FilterConfig(com=0.005, velocity=0.05)
Q, R = process_noise(TICK, 1.0), np.diag([0.005**2, 0.05**2])
SMALL = {"ticks_per_step": 10, "double_support_ticks": 1, "stride": 0.02, "com_height_amplitude": 0.002}


def test_the_steady_gain_is_that_of_a_batch_least_squares_estimate() -> None:
    # The last state of many, from all measurements and all steps of the model, weighted by their covariances.
    rng, count = np.random.default_rng(0), 120
    by = np.array([[TICK**2 / 2.0, TICK**2], [TICK, 0.0]])  # of an acceleration, and of the position's own error
    measured = rng.normal(size=(count, 2)) * [0.005, 0.05]
    rows, sides = [], []
    for k in range(count):
        row = np.zeros((2, 2 + 2 * count))  # unknown: the first state, and both errors of each tick
        row[:, :2] = np.linalg.matrix_power(A, k)
        for j in range(k):
            row[:, 2 + 2 * j : 4 + 2 * j] = np.linalg.matrix_power(A, k - 1 - j) @ by
        last = row
        rows.append(row / np.array([[0.005], [0.05]]))
        sides.append(measured[k] / [0.005, 0.05])
    rows.append(np.hstack([np.zeros((2 * count, 2)), np.eye(2 * count)]))
    sides.append(np.zeros(2 * count))
    batch = last @ np.linalg.lstsq(np.vstack(rows), np.concatenate(sides), rcond=None)[0]
    gain, _ = steady_gain(A, Q, R)
    state = measured[0]
    for k in range(1, count):
        state = A @ state
        state = state + gain @ (measured[k] - state)
    np.testing.assert_allclose(state, batch, atol=2e-5)


def test_the_gain_of_a_late_measurement_is_that_of_one_in_time_seen_a_while_later() -> None:
    rng, delay = np.random.default_rng(1), 4
    own, late = CoMFilter(VHIP, NOISE), CoMFilter(VHIP, NOISE, delay)
    moved = np.linalg.matrix_power(A, delay)
    then, now = np.zeros((2, 3)), np.zeros((2, 3))
    evidence = np.zeros(2)
    for _ in range(60):
        measured = np.zeros((2, 3))
        measured[:, :2] = rng.normal(size=(2, 2)) * [1e-4, 1e-3]
        carried = measured.copy()
        carried[:, :2] = measured[:, :2] @ moved.T
        own.believed(then, measured, np.zeros(2))
        evidence = late.believed(now, carried, evidence)
        np.testing.assert_allclose(carried[:, :2], measured[:, :2] @ moved.T, atol=1e-12)
        then[:, :2], now[:, :2] = measured[:, :2] @ A.T, carried[:, :2] @ A.T


def test_a_measurement_without_noise_is_believed() -> None:
    exact = CoMFilter(VHIP, FilterConfig(com=0.0, velocity=1e-6))
    np.testing.assert_allclose(exact.gain, np.eye(2), atol=5e-2)
    np.testing.assert_allclose(exact.pushed_gain, np.eye(2), atol=5e-2)


def test_a_push_opens_the_filter_and_noise_does_not() -> None:
    rng, kalman = np.random.default_rng(2), CoMFilter(VHIP, NOISE)
    state, evidence, opened = np.zeros((2, 3)), np.zeros(2), 0
    for _ in range(3000):
        measured = np.zeros((2, 3))
        measured[:, :2] = rng.normal(size=(2, 2)) * [0.005, 0.05]
        error = measured[:, :2] - state[:, :2]
        evidence = kalman.believed(state, measured, evidence)
        opened += not np.allclose(measured[:, :2] - state[:, :2], error @ kalman.gain.T, atol=1e-15)
        state[:, :2] = measured[:, :2] @ A.T
    assert opened == 0
    # 100 N on 29 kg for ten ticks.
    true = state.copy()
    for k in range(30):
        true[:, :2] = true[:, :2] @ A.T
        true[0, 1] += (k < 10) * 100.0 / 29.0 * TICK
        measured = true.copy()
        measured[:, :2] += rng.normal(size=(2, 2)) * [0.005, 0.05]
        evidence = kalman.believed(state, measured, evidence)
        if k == 13:
            assert measured[0, 1] > 0.7 * true[0, 1]
        state[:, :2] = measured[:, :2] @ A.T


def test_the_filter_is_the_same_in_every_yawed_frame() -> None:
    rng, kalman = np.random.default_rng(3), CoMFilter(VHIP, NOISE)
    predicted, measured, turn = rng.normal(size=(2, 3)), rng.normal(size=(2, 3)), rotation(0.7)
    seen = turn @ measured
    evidence = kalman.believed(predicted, measured, np.array([1.0, -2.0]))
    turned = kalman.believed(turn @ predicted, seen, turn @ np.array([1.0, -2.0]))
    np.testing.assert_allclose(seen[:, :2], (turn @ measured)[:, :2], atol=1e-12)
    np.testing.assert_allclose(turned, turn @ evidence, atol=1e-9)


def test_an_undisturbed_walk_is_not_changed_by_its_filter() -> None:
    walks = [
        [tick.state for tick in walk_template(mpc, start(mpc), 0, 45)]
        for mpc in (make_mpc(SMALL, {"horizon": 20, "freeze_ticks": 2, "filter": f}) for f in (None, NOISE))
    ]
    np.testing.assert_allclose(walks[1], walks[0], atol=1e-9)


@pytest.mark.parametrize(
    ("text", "delay", "noise"),
    [
        ("{}", 0, None),
        ("measurement: {delay_ticks: 3, noise: {com: 0.01}}", 3, (0.01, 0.0)),
        ("{measurement: {delay_ticks: 3, noise: {com: 0.01}}, mpc: {delay: 1, filter: null}}", 1, None),
        ("{measurement: {noise: {com: 0.01}}, mpc: {filter: {velocity: 0.2}}}", 0, (0.0, 0.2)),
        ("measurement: {noise: {zmp: 0.01}}", 0, None),
    ],
)
def test_delay_and_noise_are_those_of_the_scenario_unless_they_are_given(text: str, delay: int, noise) -> None:
    config = sensed(load_scenario("vhip", text))
    assert config.delay_ticks == delay
    assert (None if config.noise is None else (config.noise.com, config.noise.velocity)) == noise
