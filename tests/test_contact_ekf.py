"""The filter on steps in exact kinematics: consistency, invariance, what it can't observe, and batch least squares."""

from __future__ import annotations

import numpy as np
import pytest
from biped_cases import biped
from scipy.spatial.transform import Rotation
from sensed_steps import TICK, Motion, samples, stepping

from pdhocbf_drake.estimation import kernels
from pdhocbf_drake.estimation.anchor import AnchorFilter
from pdhocbf_drake.estimation.config import SensorsConfig
from pdhocbf_drake.estimation.contact_ekf import ContactEkf
from pdhocbf_drake.estimation.errors import write_errors
from pdhocbf_drake.estimation.kernels import DP, DSOLES, ERRORS, GYRO_BIAS, OFFSETS, PHI, P, R, V
from pdhocbf_drake.estimation.memory import Memory
from pdhocbf_drake.estimation.sample import Estimate, Notice, Sample

CONFIG = SensorsConfig()
SETTLED = 80  # ticks


def run(estimator: ContactEkf | AnchorFilter, given: list[Sample]) -> tuple[list[Memory], list[Estimate]]:
    memory, memories, estimates = Memory(), [], []
    for sample in given:
        memory, estimate = estimator.step(memory, sample)
        memories.append(memory)
        estimates.append(estimate)
    return memories, estimates


def errors(motion: Motion, memories: list[Memory]) -> np.ndarray:
    """Observable errors and NEES at each tick (T, 9)."""
    quaternions = Rotation.from_matrix(motion.turn).as_quat()[:, [3, 0, 1, 2]]
    out = np.empty((len(memories), 9))
    for k, memory in enumerate(memories):
        base = np.concatenate([quaternions[k], motion.place[k]])
        write_errors(memory, base, motion.velocity[k], motion.soles[k], out[k])
    return out


@pytest.fixture(scope="module")
def seeds() -> tuple[list[list[Memory]], np.ndarray]:
    """Memories and errors of fifty runs with biases, offsets and noise of their own, (50, T, 9)."""
    motion, estimator = stepping(200), ContactEkf(biped(), CONFIG)
    runs = [run(estimator, samples(motion, CONFIG, seed))[0] for seed in range(50)]
    return runs, np.array([errors(motion, memories) for memories in runs])


def test_without_noise_it_is_exact():
    motion, quiet = stepping(), SensorsConfig.model_validate({"encoders": {"offset": 0.0}})
    found = errors(motion, run(ContactEkf(biped(), quiet), samples(motion, quiet, None))[0])
    assert np.abs(found[:, :2]).max() < 1e-4
    assert np.abs(found[:, 2:5]).max() < 6e-3  # the motion's velocity is a difference over two ticks
    assert np.abs(found[:, 5:8]).max() < 1e-4


def test_errors_are_as_large_as_it_says(seeds):
    """Mean NEES of fifty independent runs, χ² with 8 · 50 degrees of freedom over 50: 95 % are below 9.15."""
    mean = seeds[1][:, SETTLED:, 8].mean(axis=0)
    assert np.mean(mean < 9.15) > 0.9
    assert mean.mean() > 1.0


def test_the_gyroscope_s_bias_is_found(seeds):
    before, after = (np.array([memories[k].estimate[GYRO_BIAS + 2] for memories in seeds[0]]) for k in (0, -1))
    truth = np.array([CONFIG.imu.gyro_bias * np.random.default_rng(seed).normal(size=6)[2] for seed in range(50)])
    assert np.std(after - truth) < 0.3 * np.std(before - truth)


def test_place_and_heading_are_not_learned(seeds):
    """Their uncertainty grows, once tilt and height are found, and never shrinks."""
    memories = seeds[0][0][SETTLED::10]
    heading = np.array([memory.covariance[PHI + 2, PHI + 2] for memory in memories])
    assert np.all(np.diff(heading) >= -1e-12)
    soles = [DSOLES, DSOLES + 1, DSOLES + 3, DSOLES + 4]
    place = np.array([memory.covariance[soles, soles].sum() for memory in memories])
    assert place[-1] > place[len(place) // 2] > place[0]


def test_no_row_tells_place_or_heading():
    """A move of base and soles together, and a turn of all about the vertical, leave every residual as it is."""
    estimator = ContactEkf(biped(), CONFIG)
    memories, _ = run(estimator, samples(stepping(), CONFIG, 0)[:60])
    legs, rows, residuals = estimator.legs, np.empty((7, ERRORS)), np.empty(7)
    ways = np.zeros((3, ERRORS))
    for axis in (0, 1):
        ways[axis, [DP + axis, DSOLES + axis, DSOLES + 3 + axis]] = 1.0
    ways[2, PHI + 2] = 1.0  # the invariant error of a turn about the world's origin
    for side in (0, 1):
        kernels.write_rows(
            memories[-1].estimate, side, legs.ways[side], legs.way_rates[side], legs.turns[side], legs.turn_rates[side],
            np.zeros(3), rows, residuals,
        )  # fmt: skip
        np.testing.assert_allclose(rows @ ways.T, 0.0, atol=1e-12)


@pytest.mark.parametrize("kind", [ContactEkf, AnchorFilter])
def test_it_is_the_same_anywhere_and_in_any_heading(kind):
    yaw, way = 2.1, np.array([70.0, -40.0])
    given = samples(stepping(), CONFIG, 3)[:160]
    here, first = run(kind(biped(), CONFIG), given)
    there, second = run(kind(biped(), CONFIG, TICK, (*way.tolist(), yaw)), given)
    turn = Rotation.from_euler("z", yaw).as_matrix()
    a, b = here[-1].estimate, there[-1].estimate
    np.testing.assert_allclose(b[R:V].reshape(3, 3), turn @ a[R:V].reshape(3, 3), atol=1e-8)
    np.testing.assert_allclose(b[V:P], turn @ a[V:P], atol=1e-8)
    np.testing.assert_allclose(b[P : P + 3], turn @ a[P : P + 3] + [*way, 0.0], atol=1e-7)
    np.testing.assert_allclose(b[GYRO_BIAS:], a[GYRO_BIAS:], atol=1e-8)
    moved = turn[:2, :2] @ first[-1].lip_state[[0, 3]] + way
    np.testing.assert_allclose(second[-1].lip_state[[0, 3]], moved, atol=1e-7)
    np.testing.assert_allclose(second[-1].deviation, _turned(first[-1].deviation, second[-1].deviation), atol=1e-6)


def _turned(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Deviations in x and y mix under a turn; those along z and the total stay."""
    out = second.copy()
    out[[2, 5]] = first[[2, 5]]
    for start in (0, 3):
        total, now = np.hypot(*first[start : start + 2]), np.hypot(*second[start : start + 2])
        out[start : start + 2] *= total / now if now else 1.0
    return out


def test_a_stand_is_that_of_batch_least_squares():
    """In a stand the filter is linear in its errors: minimum of prior, process and rows over all ticks at once."""
    config = SensorsConfig.model_validate({"encoders": {"offset": 0.0}})
    estimator, given = ContactEkf(biped(), config), samples(stepping(), config, 5)[:12]
    memory, _ = estimator.step(Memory(), given[0])
    start = Memory(memory.vector)
    imu, feet = config.imu, config.estimator
    noise = np.square(
        [imu.gyro_noise, imu.accelerometer_noise, feet.slip, imu.gyro_bias_walk, imu.accelerometer_bias_walk]
    )
    variances = np.square([*[feet.kinematics] * 3, feet.flat, feet.flat, feet.height, feet.foot_rate])
    # Nominal states without any correction, their transitions, noise, rows and residuals.
    nominal, count = [start.estimate.copy()], OFFSETS
    legs, size = estimator.legs, count * len(given)
    matrix, vector = np.zeros((size, size)), np.zeros(size)
    prior = np.linalg.pinv(start.covariance[:count, :count], rcond=1e-14)
    # Place and heading are certain at the start: the prior's null space is held by a large weight.
    values, vectors = np.linalg.eigh(start.covariance[:count, :count])
    matrix[:count, :count] += prior + vectors[:, values < 1e-13] @ vectors[:, values < 1e-13].T * 1e14
    for k, sample in enumerate(given[1:], start=1):
        estimate, spread = nominal[-1].copy(), np.zeros((ERRORS, ERRORS))
        change = _transition(estimate, sample, estimator)
        kernels.propagate(estimate, spread, sample.imu, np.array([0.0, 0.0, -9.81]), TICK, noise)
        nominal.append(estimate)
        spread = spread[:count, :count] + 1e-14 * np.eye(count)
        weight = np.linalg.inv(spread)
        block = np.hstack([-change, np.eye(count)])
        both = slice(count * (k - 1), count * (k + 1))
        matrix[both, both] += block.T @ weight @ block
        legs.set_joints(sample.encoders[:12])
        before = given[k - 1].encoders[:12]
        for side in (0, 1):
            rows, residuals, spin = np.empty((7, ERRORS)), np.empty(7), np.empty(3)
            turn = legs.turns[side].copy()
            legs.set_joints(before)
            earlier = legs.turns[side].copy()
            legs.set_joints(sample.encoders[:12])
            kernels.write_spin(sample.imu[:3] - nominal[-2][GYRO_BIAS : GYRO_BIAS + 3], TICK, earlier, turn, spin)
            kernels.write_rows(
                estimate, side, legs.ways[side], legs.way_rates[side], turn, legs.turn_rates[side], spin, rows,
                residuals,
            )  # fmt: skip
            rows, here = rows[:, :count], slice(count * k, count * (k + 1))
            matrix[here, here] += rows.T @ (rows / variances[:, None])
            vector[here] += rows.T @ (residuals / variances)
        memory, _ = estimator.step(memory, sample)
    batch = np.linalg.solve(matrix, vector)[-count:]
    expected = nominal[-1].copy()
    kernels.correct(expected, np.concatenate([batch, np.zeros(ERRORS - count)]))
    moved = np.abs(nominal[-1] - expected)
    np.testing.assert_allclose(memory.estimate, expected, atol=0.02 * moved.max() + 1e-7)


def _transition(estimate: np.ndarray, sample: Sample, estimator: ContactEkf) -> np.ndarray:
    """Φ (21, 21) from the covariance of two errors at once: P = e_i e_jᵀ + e_j e_iᵀ gives Φ_i Φ_jᵀ + Φ_j Φ_iᵀ."""
    change = np.eye(OFFSETS)
    for column in range(OFFSETS):
        spread = np.zeros((ERRORS, ERRORS))
        spread[column, OFFSETS] = spread[OFFSETS, column] = 1.0  # an offset does not change
        kernels.propagate(estimate.copy(), spread, sample.imu, np.array([0.0, 0.0, -9.81]), TICK, np.zeros(5))
        change[:, column] = spread[:OFFSETS, OFFSETS]
    return change


def test_a_memory_s_vector_continues_bit_for_bit():
    given = samples(stepping(), CONFIG, 1)[:120]
    memories, estimates = run(ContactEkf(biped(), CONFIG), given)
    memory = Memory(memories[70].vector)
    other = ContactEkf(biped(), CONFIG)
    for k in range(71, 120):
        memory, estimate = other.step(memory, given[k])
    assert memory.vector.tobytes() == memories[-1].vector.tobytes()
    assert estimate.lip_state.tobytes() == estimates[-1].lip_state.tobytes()


def test_a_correction_of_the_world_does_not_move_the_stance_foot():
    given = samples(stepping(), CONFIG, 2)[:240]
    memories, estimates = run(ContactEkf(biped(), CONFIG), given)
    for k in range(SETTLED, 239):
        side = int(memories[k].anchor[0])
        if side == int(memories[k + 1].anchor[0]) and memories[k + 1].standing[side] and memories[k].standing[side]:
            feet = [estimates[j].foot_state[6 * side : 6 * side + 2] for j in (k, k + 1)]
            np.testing.assert_allclose(feet[1], feet[0], atol=1e-9)


FAULTS = {
    "gyroscope": ("imu", [0, 1, 2, 6, 7, 8], Notice.GYROSCOPE),
    "accelerometer": ("imu", [3, 4, 5], Notice.ACCELEROMETER),
    "imu": ("imu", list(range(9)), Notice.GYROSCOPE | Notice.ACCELEROMETER),
    "knee": ("encoders", [3, 15], Notice.ENCODER),
    "all encoders": ("encoders", list(range(24)), Notice.ENCODER),
    "left force": ("force_torque", list(range(6)), Notice.FORCE_TORQUE),
    "all forces": ("force_torque", list(range(12)), Notice.FORCE_TORQUE),
}


@pytest.mark.parametrize("value", [np.nan, "stuck"])
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("kind", [ContactEkf, AnchorFilter])
def test_a_sensor_that_fails_is_noticed_and_stood_in_for(kind, fault, value):
    """From tick 150 on, in mid-swing, for half a second."""
    port, places, expected = FAULTS[fault]
    motion, given = stepping(), samples(stepping(), CONFIG, 4)[:220]
    targets = [sample.encoders for sample in samples(motion, CONFIG, None)[:220]]
    supports = [0.0 if k < 80 else (-1.0 if (k // 40) % 2 == 0 else 1.0) for k in range(220)]
    failing = []
    for k, sample in enumerate(given):
        sample = sample._replace(targets=targets[k], support=supports[k])
        if 150 <= k < 200:
            said = getattr(sample, port).copy()
            said[places] = getattr(given[150], port)[places] if value == "stuck" else value
            sample = sample._replace(**{port: said})
        failing.append(sample)
    memories, estimates = run(kind(biped(), CONFIG), failing)
    notices = [Notice(int(estimate.status[0])) for estimate in estimates]
    assert any(notice & expected == expected for notice in notices[150:170])
    assert not any(notices[80:150])
    assert not any(notice & expected for notice in notices[203:])
    found = errors(motion, memories)
    assert np.isfinite([estimate.lip_state for estimate in estimates]).all()
    assert np.abs(found[150:, 2:5]).max() < 0.15
    assert np.abs(found[150:, 5:8]).max() < 0.02


@pytest.mark.parametrize("fault", ["gyroscope", "accelerometer", "imu"])
def test_an_imu_that_says_nothing_but_zeros_is_noticed_in_the_same_tick(fault):
    _, places, expected = FAULTS[fault]
    given = samples(stepping(), CONFIG, 4)[:20]
    given[10].imu[places] = 0.0
    _, estimates = run(ContactEkf(biped(), CONFIG), given)
    notices = [Notice(int(estimate.status[0])) & FAULTS["imu"][2] for estimate in estimates]
    assert [k for k, notice in enumerate(notices) if notice] == [10]
    assert notices[10] == expected


def test_whatever_the_sensors_say_nothing_raises():
    random, estimator, memory = np.random.default_rng(0), ContactEkf(biped(), CONFIG), Memory()
    for sample in samples(stepping(), CONFIG, 6)[:150]:
        wild = []
        for values in sample[:3]:
            values = values.copy()
            if random.random() < 0.5:
                places = random.integers(0, len(values), 4)
                values[places] = random.choice([np.nan, np.inf, -np.inf, 1e9, 0.0], 4)
            wild.append(values)
        memory, _ = estimator.step(memory, Sample(*wild))


def test_the_anchor_s_velocity_follows_the_legs_and_it_claims_no_certainty():
    motion = stepping()
    memories, estimates = run(AnchorFilter(biped(), CONFIG), samples(motion, CONFIG, 7))
    found = errors(motion, memories)[SETTLED:]
    assert np.sqrt(np.mean(found[:, 2:5] ** 2)) < 0.015
    assert np.abs(found[:, 5:8]).max() < 0.01
    assert not found[:, 8].any()
    assert not np.any([estimate.deviation for estimate in estimates[1:]])
