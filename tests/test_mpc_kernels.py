"""The machine code of the controller's tick against plain numpy."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.mpc.kernels import (
    believe,
    same_bits,
    write_cancelling,
    write_common,
    write_plan,
    write_sent,
)
from pdhocbf_drake.mpc.memory_layout import joined


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("zmp_measured", [False, True])
@pytest.mark.parametrize("broken", [None, (0, 0), (1, 1), (0, 2)])
def test_the_believed_state(seed: int, zmp_measured: bool, broken: tuple[int, int] | None) -> None:
    random = np.random.default_rng(seed)
    planned, measured, before = random.normal(size=(2, 3)), random.normal(size=(2, 3)), random.normal(size=4)
    if seed == 0:
        before = measured[:, :2].ravel().copy()
    if broken is not None:
        measured[broken] = np.nan if seed % 2 else np.inf
    latency, eta, state, com = 0.004, 17.0, np.empty((2, 3)), np.empty(4)
    finite, repeats, moves = believe(planned, measured, before, zmp_measured, latency, eta, state, com)
    c, v = measured[:, 0], measured[:, 1]
    p = measured[:, 2] if zmp_measured else planned[:, 2]
    assert finite == bool(np.isfinite([c, v, p]).all())
    assert repeats == np.array_equal(measured[:, :2].ravel(), before)
    if finite:
        np.testing.assert_allclose(state, np.column_stack([c + latency * v, v + latency * eta * (c - p), p]))
        np.testing.assert_allclose(moves, np.abs(planned - measured)[:, :2].max())
        np.testing.assert_array_equal(com, measured[:, :2].ravel())


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("barriers", [([], []), ([5, 4], []), ([3], [2, 6])])
@pytest.mark.parametrize("soft", [True, False])
def test_a_plan_from_the_decisions(seed: int, barriers: tuple[list[int], list[int]], soft: bool) -> None:
    random = np.random.default_rng(seed)
    inputs, footholds, slacks = np.empty((2, 7)), np.empty((2, 2)), np.empty(sum(map(len, barriers)))
    starts = [np.cumsum([0, *counts])[: len(counts)] for counts in barriers]
    parts = [[random.normal(size=count) * random.integers(0, 2) for count in counts] for counts in barriers]
    x, y = (np.concatenate([random.normal(size=9), *(own if soft else [])]) for own in parts)
    rows = [random.integers(0, 2, (len(counts), 9)).astype(float) for counts in barriers]
    active = [random.choice([-1.0, 0.0, 0.0, 0.0, 1.0], 9 + (own_program == 0)) for own_program in (seed > 0, True)]
    acting = np.empty_like(slacks)
    largest = write_plan(x, y, *starts, *rows, *active, 0.1, inputs, footholds, slacks, acting)
    np.testing.assert_array_equal(inputs, [x[:7], y[:7]])
    np.testing.assert_array_equal(footholds, [x[7:9], y[7:9]])
    np.testing.assert_array_equal(slacks, [own.max() if soft else 0.0 for axis in parts for own in axis])
    assert largest == max(0.0, slacks.max(initial=0.0))
    expected = [own @ np.abs(flags) > 0.0 for own, flags in zip(rows, active, strict=True) if len(flags) == 9]
    if seed == 0:  # another program than its own was solved on x
        expected.insert(0, slacks[: len(barriers[0])] > 0.1)
    np.testing.assert_array_equal(acting, np.concatenate(expected))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("horizon", [0, 7])
def test_what_all_thetas_begin_with(axis: int, horizon: int) -> None:
    random = np.random.default_rng(axis)
    of_step, theta = random.normal(size=20), np.empty(20)
    state, stance, offset = random.normal(size=(2, 3)), random.normal(size=(2, 2)), random.normal(size=(2, horizon))
    write_common(of_step, axis, state, stance, offset, theta)
    np.testing.assert_array_equal(theta, [*state[axis], *stance[axis], *offset[axis], *of_step[5 + horizon :]])


def test_the_same_bits() -> None:
    vector = np.array([1.0, np.nan, -0.0, np.inf])
    assert same_bits(vector, vector.copy())
    for i, value in enumerate((np.nextafter(1.0, 2.0), 0.0, 0.0, -np.inf)):
        other = vector.copy()
        other[i] = value
        assert not same_bits(vector, other)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_sent_cancels_the_disturbance_and_leads_the_lag(seed: int) -> None:
    random = np.random.default_rng(seed)
    w, velocity, before = random.normal(size=4), random.normal(size=2), random.normal(size=2)
    planned_com, planned_zmp, shift = random.normal(size=6), random.normal(size=4), np.empty(2)
    com, zmp, eta, ahead, tick = planned_com.copy(), planned_zmp.copy(), 17.0, 0.02, 0.01
    write_sent(w, eta, ahead, tick, velocity, before, com, zmp, shift)
    np.testing.assert_allclose(shift, w[2:] / eta + ahead * velocity)
    np.testing.assert_allclose(com.reshape(2, 3) - planned_com.reshape(2, 3), np.outer(-eta * shift, [0, 0, 1]))
    np.testing.assert_allclose(zmp.reshape(2, 2) - planned_zmp.reshape(2, 2), np.c_[shift, (shift - before) / tick])


@pytest.mark.parametrize("first", [0, 3, 11])
def test_the_offset_that_cancels_a_disturbance(first: int) -> None:
    random = np.random.default_rng(first)
    w, eta, offset = random.normal(size=4), 10.0 + random.random(5), random.normal(size=(2, 9))
    both = np.empty((2, 9))
    write_cancelling(w, eta, first, offset, both)
    np.testing.assert_allclose(both, offset + w[2:, None] / np.resize(np.roll(eta, -first), 9))


def test_joined_arrays_are_those_of_numpy_however_they_lie_in_memory() -> None:
    whole = np.random.default_rng(0).normal(size=(4, 5))
    for odd in (whole, whole.T, whole[:, 1], whole[::2], np.arange(3), np.array([True]), np.zeros((2, 0))):
        parts = [whole[0], odd, whole[1:3]]
        found = joined(parts)
        assert np.array_equal(found, np.concatenate(parts, axis=None))
        found[0] = 1.0  # an array of its own
        assert whole[0, 0] != 1.0
