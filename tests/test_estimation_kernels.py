"""Every compiled loop of `pdhocbf_drake.estimation` beside a few lines of numpy or scipy; Jacobians by differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from biped_cases import biped
from numba.core.registry import CPUDispatcher
from scipy.spatial.transform import Rotation

from pdhocbf_drake.estimation import kernels
from pdhocbf_drake.estimation.kernels import (
    ACCELEROMETER_BIAS,
    DACCELEROMETER,
    DGYRO,
    DP,
    DSOLES,
    ERRORS,
    ESTIMATE,
    GYRO_BIAS,
    OFFSETS,
    PHI,
    SOLES,
    P,
    R,
    V,
)  # fmt: skip
from pdhocbf_drake.estimation.legs import Legs

Values = tuple[np.ndarray | float, ...]
Case = Callable[[np.random.Generator], tuple[Values, Values]]
"""Runs a kernel and its reference on random arrays: what both return and write."""

GRAVITY = np.array([0.0, 0.0, -9.81])
TICK = 0.01
QUIET = np.zeros(5)


def skew(a: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def estimate_of(random: np.random.Generator) -> np.ndarray:
    estimate = random.normal(size=ESTIMATE)
    estimate[R:V] = Rotation.random(random_state=random).as_matrix().ravel()
    return estimate


def covariance_of(random: np.random.Generator) -> np.ndarray:
    root = random.normal(size=(ERRORS, ERRORS))
    return root @ root.T


def moved(estimate: np.ndarray, error: np.ndarray) -> np.ndarray:
    """exp(ξ) X with biases b + ξ_b, for a small ξ (21,): X̂ whose error is ξ."""
    turn = Rotation.from_rotvec(error[PHI : PHI + 3]).as_matrix()
    out = estimate.copy()
    out[R:V] = (turn @ estimate[R:V].reshape(3, 3)).ravel()
    for part in range(4):
        here, there = slice(V + 3 * part, V + 3 * part + 3), slice(3 + 3 * part, 6 + 3 * part)
        out[here] = turn @ estimate[here] + error[there]
    out[GYRO_BIAS:] += error[DGYRO:OFFSETS]
    return out


def error_of(estimate: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """ξ (21,) of X̂ = exp(ξ) X, to first order."""
    turn = estimate[R:V].reshape(3, 3) @ truth[R:V].reshape(3, 3).T
    out = np.empty(OFFSETS)
    out[PHI : PHI + 3] = Rotation.from_matrix(turn).as_rotvec()
    for part in range(4):
        here = slice(V + 3 * part, V + 3 * part + 3)
        out[3 + 3 * part : 6 + 3 * part] = estimate[here] - turn @ truth[here]
    out[DGYRO:] = (estimate - truth)[GYRO_BIAS:]
    return out


def rotate(random: np.random.Generator) -> tuple[Values, Values]:
    rotation, vector, out = random.normal(size=9), random.normal(size=3), np.empty(3)
    kernels.rotate(rotation, vector, out)
    return (out,), (rotation.reshape(3, 3) @ vector,)


def write_exp(random: np.random.Generator) -> tuple[Values, Values]:
    vector, out = random.normal(size=3) * random.choice([1e-6, 1e-3, 1.0]), np.empty(9)
    kernels.write_exp(vector, out)
    return (out,), (Rotation.from_rotvec(vector).as_matrix().ravel(),)


def write_log(random: np.random.Generator) -> tuple[Values, Values]:
    vector, out = random.normal(size=3) * random.choice([1e-6, 1e-3, 0.5]), np.empty(3)
    kernels.write_log(Rotation.from_rotvec(vector).as_matrix().ravel(), out)
    return (out,), (Rotation.from_rotvec(vector).as_rotvec(),)


def write_turned(random: np.random.Generator) -> tuple[Values, Values]:
    a, b, out = random.normal(size=9), random.normal(size=9), np.empty(9)
    kernels.write_turned(a, b, out)
    return (out,), ((a.reshape(3, 3) @ b.reshape(3, 3)).ravel(),)


def orthonormalize(random: np.random.Generator) -> tuple[Values, Values]:
    rotation = Rotation.random(random_state=random).as_matrix()
    rough = (rotation @ (np.eye(3) + 1e-6 * np.diag(random.normal(size=3)))).ravel()
    kernels.orthonormalize(rough)
    return (rough,), (rotation.ravel(),)


def set_skew(random: np.random.Generator) -> tuple[Values, Values]:
    vector, out = random.normal(size=3), np.zeros((5, 4))
    kernels.set_skew(vector, 2.0, 1, 1, out)
    expected = np.zeros((5, 4))
    expected[1:4, 1:4] = 2.0 * skew(vector)
    return (out,), (expected,)


def carry(random: np.random.Generator) -> tuple[Values, Values]:
    change, covariance = random.normal(size=(15, 21)), covariance_of(random)
    whole = np.eye(ERRORS)
    whole[:15, :21] += change
    expected = whole @ covariance @ whole.T
    kernels.carry(change, covariance)
    return (covariance,), (expected,)


def place_sole(random: np.random.Generator) -> tuple[Values, Values]:
    estimate, covariance, side = estimate_of(random), covariance_of(random), int(random.integers(2))
    way, rates = random.normal(size=3), random.normal(size=(3, 12))
    rotation, first = estimate[R:V].reshape(3, 3), DSOLES + 3 * side
    expected, whole = estimate.copy(), np.eye(ERRORS)
    expected[SOLES + 3 * side : SOLES + 3 * side + 3] = estimate[P : P + 3] + rotation @ way
    whole[first : first + 3] = 0.0
    whole[first : first + 3, DP : DP + 3], whole[first : first + 3, OFFSETS:] = np.eye(3), rotation @ rates
    spread = whole @ covariance @ whole.T
    spread[first : first + 3, first : first + 3] += 0.3 * np.eye(3)
    kernels.place_sole(estimate, covariance, side, way, rates, 0.3)
    return (estimate, covariance), (expected, spread)


def update(random: np.random.Generator) -> tuple[Values, Values]:
    """The gain of what is estimated is optimal, the considered offsets have none; Joseph's form."""
    estimate, covariance = estimate_of(random), covariance_of(random)
    rows, residuals, variances = random.normal(size=(5, ERRORS)), 1e-3 * random.normal(size=5), random.uniform(1, 2, 5)
    innovation = rows @ covariance @ rows.T + np.diag(variances)
    gain = covariance @ rows.T @ np.linalg.inv(innovation)
    gain[OFFSETS:] = 0.0
    left, corrected = np.eye(ERRORS) - gain @ rows, estimate.copy()
    spread = left @ covariance @ left.T + gain @ np.diag(variances) @ gain.T
    kernels.correct(corrected, gain @ residuals)
    nis = kernels.update(estimate, covariance, rows, residuals, variances)
    return (nis, estimate, covariance), (residuals @ np.linalg.solve(innovation, residuals), corrected, spread)


def correct(random: np.random.Generator) -> tuple[Values, Values]:
    """exp of the group as the matrix exponential's own series."""
    from scipy.linalg import expm

    estimate, error = estimate_of(random), random.normal(size=ERRORS)
    size, algebra, group = 7, np.zeros((7, 7)), np.eye(7)
    algebra[:3, :3], algebra[:3, 3:] = -skew(error[:3]), -error[3:15].reshape(4, 3).T
    group[:3, :3], group[:3, 3:] = estimate[R:V].reshape(3, 3), estimate[V:GYRO_BIAS].reshape(4, 3).T
    after = expm(algebra) @ group
    assert after.shape == (size, size)
    bias = estimate[GYRO_BIAS:] - error[DGYRO:OFFSETS]
    expected = np.concatenate([after[:3, :3].ravel(), after[:3, 3:].T.ravel(), bias])
    kernels.correct(estimate, error)
    return (estimate,), (expected,)


def left_jacobian(random: np.random.Generator) -> tuple[Values, Values]:
    vector = random.normal(size=3) * random.choice([1e-6, 1.0])
    times = (np.arange(2000) + 0.5) / 2000
    mean = Rotation.from_rotvec(np.multiply.outer(times, vector)).as_matrix().mean(axis=0)
    return (np.round(kernels.left_jacobian(vector), 6),), (np.round(mean, 6),)


def vector_of(random: np.random.Generator) -> tuple[Values, Values]:
    rotation = random.normal(size=9)
    return (np.array(kernels.vector_of(rotation, 2)),), (rotation[6:],)


def farthest(random: np.random.Generator) -> tuple[Values, Values]:
    covariance, rows, residuals = covariance_of(random), random.normal(size=(3, ERRORS)), random.normal(size=3)
    variances = random.uniform(1, 2, 3)
    spread = np.sqrt(np.diag(rows @ covariance @ rows.T) + variances)
    return (kernels.farthest(covariance, rows, residuals, variances),), (np.max(np.abs(residuals) / spread),)


def write_spin(random: np.random.Generator) -> tuple[Values, Values]:
    rate, out = random.normal(size=3), np.empty(3)
    before, way = Rotation.random(random_state=random), Rotation.from_rotvec(0.01 * random.normal(size=3))
    now = way * before
    kernels.write_spin(rate, TICK, before.as_matrix().ravel(), now.as_matrix().ravel(), out)
    return (out,), ((Rotation.from_rotvec(TICK * rate) * now * before.inv()).as_rotvec() / TICK,)


def propagate(random: np.random.Generator) -> tuple[Values, Values]:
    """A sampled tick of constant rate and force in the turning axes, which the IMU joins with its bias of the rate."""
    estimate, imu, parts = estimate_of(random), random.normal(size=9), 2000
    times, short = (np.arange(parts) + 0.5) * TICK / parts, TICK / parts
    rotation, velocity, place = (estimate[i:j].copy() for i, j in ((R, V), (V, P), (P, SOLES)))
    bias, slowing = estimate[GYRO_BIAS:ACCELEROMETER_BIAS], estimate[ACCELEROMETER_BIAS:].copy()
    force = imu[3:6].copy()
    imu[3:6] = (Rotation.from_rotvec(np.multiply.outer(times, imu[:3])).as_matrix() @ force).mean(axis=0)
    turns = rotation.reshape(3, 3) @ Rotation.from_rotvec(np.multiply.outer(times, imu[:3] - bias)).as_matrix()
    gains = short * np.cumsum(turns @ (force - slowing) + GRAVITY, axis=0)
    turned = rotation.reshape(3, 3) @ Rotation.from_rotvec(TICK * (imu[:3] - bias)).as_matrix()
    rest = estimate[SOLES:].copy()
    kernels.propagate(estimate, np.zeros((ERRORS, ERRORS)), imu, GRAVITY, TICK, QUIET)
    expected = [turned.ravel(), velocity + gains[-1], place + TICK * velocity + short * gains.sum(axis=0), rest]
    return (np.round(estimate, 5),), (np.round(np.concatenate(expected), 5),)


def write_rows(random: np.random.Generator) -> tuple[Values, Values]:
    """Residuals; the rows are compared with differences below."""
    estimate, side = estimate_of(random), int(random.integers(2))
    way, spin, turn = random.normal(size=3), random.normal(size=3), Rotation.random(random_state=random).as_matrix()
    rows, residuals = np.empty((7, ERRORS)), np.empty(7)
    kernels.write_rows(
        estimate, side, way, random.normal(size=(3, 12)), turn.ravel(), random.normal(size=(3, 12)), spin, rows,
        residuals,
    )  # fmt: skip
    rotation, sole = estimate[R:V].reshape(3, 3), estimate[SOLES + 3 * side : SOLES + 3 * side + 3]
    place, normal = rotation @ way - (sole - estimate[P : P + 3]), (rotation @ turn)[:2, 2]
    return (residuals,), (np.concatenate([place, normal, [sole[2], (rotation @ spin)[2]]]),)


def write_imu(random: np.random.Generator) -> tuple[Values, Values]:
    """A tick at a constant rate and force in the turning axes: joined exactly, to second order of a sample."""
    rate, force, bias = random.normal(size=3), random.normal(size=3), 0.1 * random.normal(size=6)
    samples, time, numbers = 5, 0.002, np.repeat([[0.0], [0.0], [1e3], [1e-12]], 6, axis=1)
    state = np.concatenate([[-1.0], np.zeros(6), bias, np.eye(3).ravel(), np.zeros(3)])
    out = np.empty(9 + len(state))
    for i in range(samples + 1):
        kernels.write_imu(state, i * time * np.concatenate([rate, force]), np.zeros(12), numbers, samples, time, out)
        state = out[9:].copy()
    rate, force = rate + bias[:3], force + bias[3:]
    turns = Rotation.from_rotvec(np.multiply.outer((np.arange(1000) + 0.5) / 1000 * samples * time, rate)).as_matrix()
    expected = np.concatenate([rate, turns.mean(axis=0) @ force, rate])
    return (np.round(out[:9], 5),), (np.round(expected, 5),)


CASES: list[Case] = [
    rotate, write_exp, write_log, write_turned, orthonormalize, set_skew, carry, place_sole, update, correct,
    left_jacobian, vector_of, farthest, write_spin, propagate, write_rows, write_imu,
]  # fmt: skip


SAMPLED = write_imu, propagate


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_the_kernel_is_its_reference(case):
    for seed in range(5):
        for found, expected in zip(*case(np.random.default_rng(seed)), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=2e-5 if case in SAMPLED else 1e-9)


def test_every_kernel_has_a_reference():
    found = {name for name, value in vars(kernels).items() if isinstance(value, CPUDispatcher)}
    assert found - {"compiled"} == {case.__name__ for case in CASES}


@pytest.mark.parametrize("column", range(OFFSETS))
def test_errors_propagate_as_differences_do(column):
    """With P = x xᵀ and no noise, P⁺ = (Φ x)(Φ x)ᵀ."""
    random = np.random.default_rng(column)
    truth, imu, step = estimate_of(random), random.normal(size=9), 1e-5
    error = np.zeros(OFFSETS)
    error[column] = step
    ends = []
    for sign in (1.0, -1.0):
        end = moved(truth, sign * error)
        kernels.propagate(end, np.zeros((ERRORS, ERRORS)), imu, GRAVITY, TICK, QUIET)
        ends.append(end)
    centre, covariance = truth.copy(), np.zeros((ERRORS, ERRORS))
    covariance[column, column] = 1.0
    kernels.propagate(centre, covariance, imu, GRAVITY, TICK, QUIET)
    way = (error_of(ends[0], centre) - error_of(ends[1], centre)) / (2.0 * step)
    np.testing.assert_allclose(covariance[:OFFSETS, :OFFSETS], np.outer(way, way), atol=3e-6)


def test_a_gyroscope_s_noise_moves_everything_about_the_origin():
    """Noise of the rate is a turn in the base, φ = R n: it adds as the errors of n through the same step."""
    random = np.random.default_rng(3)
    truth, imu, step, tick = estimate_of(random), np.zeros(9), 1e-7, 1e-5
    covariance, expected = np.zeros((ERRORS, ERRORS)), np.zeros((OFFSETS, OFFSETS))
    centre = truth.copy()
    kernels.propagate(centre, covariance, imu, GRAVITY, tick, np.array([1.0, 0.0, 0.0, 0.0, 0.0]))
    for axis in range(3):
        noisy, end = imu.copy(), truth.copy()
        noisy[axis] = step / tick
        kernels.propagate(end, np.zeros((ERRORS, ERRORS)), noisy, GRAVITY, tick, QUIET)
        way = error_of(end, centre) / step
        expected += tick * np.outer(way, way)
    np.testing.assert_allclose(covariance[:OFFSETS, :OFFSETS] / tick, expected / tick, atol=1e-3)


@pytest.mark.parametrize("side", [0, 1])
def test_rows_of_a_standing_foot_are_differences_of_its_residuals(side):
    """About a truth whose foot is flat on the ground and at rest, where z vanishes."""
    random, legs = np.random.default_rng(side), Legs(biped())
    angles = biped().bent_knee[biped().q_index] + 0.05 * random.normal(size=12)
    legs.set_joints(angles)
    turn, way, spin = legs.turns[side].reshape(3, 3).copy(), legs.ways[side].copy(), np.zeros(3)
    truth = estimate_of(random)
    rotation = Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix() @ turn.T
    truth[R:V] = rotation.ravel()
    sole = slice(SOLES + 3 * side, SOLES + 3 * side + 3)
    truth[sole] = 1.0, 2.0, 0.0
    truth[P : P + 3] = truth[sole] - rotation @ way

    def measured(error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        legs.set_joints(angles + error[OFFSETS:])
        estimate, rows, residuals = moved(truth, error[:OFFSETS]), np.empty((7, ERRORS)), np.empty(7)
        kernels.write_rows(
            estimate, side, legs.ways[side], legs.way_rates[side], legs.turns[side], legs.turn_rates[side],
            spin - error[DGYRO : DGYRO + 3], rows, residuals,
        )  # fmt: skip
        return rows, residuals

    rows, at_truth = measured(np.zeros(ERRORS))
    np.testing.assert_allclose(at_truth, 0.0, atol=1e-12)
    steps = 1e-6 * np.eye(ERRORS)
    differences = np.array([(measured(step)[1] - measured(-step)[1]) / 2e-6 for step in steps]).T
    np.testing.assert_allclose(rows, differences, atol=1e-7)


def test_bias_columns_are_those_of_the_sensors():
    """An accelerometer's bias error b̂ − b slows the estimate by R b δ."""
    random = np.random.default_rng(0)
    truth, covariance = estimate_of(random), np.zeros((ERRORS, ERRORS))
    covariance[DACCELEROMETER, DACCELEROMETER] = 1.0
    rotation = truth[R:V].reshape(3, 3).copy()
    imu = np.concatenate([truth[GYRO_BIAS:ACCELEROMETER_BIAS], np.zeros(6)])
    kernels.propagate(truth, covariance, imu, GRAVITY, TICK, QUIET)
    np.testing.assert_allclose(covariance[3:6, DACCELEROMETER], -TICK * rotation[:, 0], atol=1e-12)
