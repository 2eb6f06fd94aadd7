"""A swing foot whose landing moves: its path, and machine code against plain numpy."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.walking import Gait, GaitConfig, swing_point
from pdhocbf_drake.walking.kernels import onward
from pdhocbf_drake.walking.swing import Swing

GAIT = Gait(GaitConfig())
SWING, PERIOD, LIFT_OFF = Swing(GAIT), GAIT.period, GAIT.config.double_support_ticks
TICK, DURATION, TICKS = 0.01, 0.36, 36
AT_REST = np.zeros((3, 2))


def swing_onward(now: np.ndarray, end: np.ndarray, remaining: float, ahead: float) -> np.ndarray:
    """Position, velocity and acceleration (3, d) from those of now, each axis by itself."""
    return np.array([onward(*axis, remaining, ahead) for axis in zip(*now, end, strict=True)]).T


def way(ends: list[np.ndarray]) -> np.ndarray:
    """Position, velocity, acceleration after each tick towards the end that holds at it, shape (ticks, 3, 2)."""
    now, points = AT_REST, []
    for k, end in enumerate(ends):
        now = swing_onward(now, end, DURATION - k * TICK, TICK)
        points.append(now)
    return np.array(points)


def test_a_landing_that_stays_gives_the_minimum_jerk_swing() -> None:
    end = np.array([0.3, -0.1])
    for k, point in enumerate(way([end] * TICKS), start=1):
        expected = swing_point(np.zeros(2), end, 0.05, DURATION, k * TICK)
        np.testing.assert_allclose(point[0], expected.position[:2], atol=1e-12)
        np.testing.assert_allclose(point[1], expected.velocity[:2], atol=1e-11)
        np.testing.assert_allclose(point[2], expected.acceleration[:2], atol=1e-9)


@settings(max_examples=50, deadline=None)
@given(st.integers(1, TICKS - 9), st.floats(-0.2, 0.2))
def test_a_landing_that_moves_bends_the_way_without_a_jump_and_is_reached_at_rest(tick: int, shift: float) -> None:
    end = np.array([0.3, 0.1])
    points = way([end] * tick + [end + shift] * (TICKS - tick))
    positions, velocities = np.vstack([[0.0, 0.0], points[:, 0]]), np.vstack([[0.0, 0.0], points[:, 1]])
    # The foot's motion in a tick is that of its velocity, to the second order of the tick.
    moved, said = np.diff(positions, axis=0), 0.5 * TICK * (velocities[1:] + velocities[:-1])
    assert abs(moved - said).max() < 3e-3
    np.testing.assert_allclose(points[-1], [end + shift, [0.0, 0.0], [0.0, 0.0]], atol=1e-12)


def test_the_polynomial_keeps_its_derivatives() -> None:
    now, end, step = np.array([[0.1], [0.7], [-3.0]]), np.array([0.25]), 1e-6
    here, there = (swing_onward(now, end, 0.2, ahead) for ahead in (0.05, 0.05 + step))
    np.testing.assert_allclose((there - here)[:2] / step, here[1:], rtol=1e-3)
    np.testing.assert_allclose(swing_onward(now, end, 0.2, 0.0), now, atol=1e-12)


def quintic(now: np.ndarray, end: float, remaining: float, ahead: float) -> np.ndarray:
    """Position, velocity, acceleration of the polynomial of degree 5 from `now` (3,) to rest at `end`."""

    def conditions(time: float) -> list[np.ndarray]:
        powers = [np.polynomial.Polynomial(row) for row in np.eye(6)]
        return [np.array([p.deriv(n)(time) if n else p(time) for p in powers]) for n in range(3)]

    coefficients = np.linalg.solve(np.array(conditions(0.0) + conditions(remaining)), [*now, end, 0.0, 0.0])
    return np.array(conditions(ahead)) @ coefficients


states = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).map(np.array)


@settings(deadline=None)
@given(states, st.floats(-0.5, 0.5), st.floats(0.05, 0.5), st.floats(0.0, 1.0))
def test_onward_is_the_polynomial_that_its_ends_determine(
    now: np.ndarray, end: float, remaining: float, part: float
) -> None:
    there = onward(*now, end, remaining, part * remaining)
    np.testing.assert_allclose(there, quintic(now, end, remaining, part * remaining), atol=1e-8)


def plain_feet(tick: int, support: int, plan: np.ndarray, before: np.ndarray) -> np.ndarray:
    """`Swing.feet` as (2 feet, 3 derivatives, 3 axes)."""
    feet = np.zeros((2, 3, 3))
    feet[:, 0, :2] = plan.reshape(2, 2, 2)[:, 0]
    aloft = tick - LIFT_OFF
    if support and aloft > 0:
        foot = 1 if support > 0 else 0
        start, end = plan.reshape(2, 2, 2)[foot]
        now = before.reshape(2, 3, 3)[foot] if aloft > 1 else np.array([[*start, 0.0], np.zeros(3), np.zeros(3)])
        left = DURATION - (aloft - 1) * TICK
        for axis in range(2):
            feet[foot, :, axis] = quintic(now[:, axis], end[axis], left, TICK)
        point = swing_point(np.zeros(2), np.zeros(2), GAIT.config.swing_height, DURATION, aloft * TICK)
        feet[foot, :, 2] = [part[2] for part in point]
    return feet.ravel()


@settings(deadline=None)
@given(st.integers(0, PERIOD), st.sampled_from([-1, 0, 1]), st.integers(0, 2**32 - 1))
def test_the_feet_are_those_of_plain_numpy(tick: int, support: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    plan, before = random.normal(size=8), random.normal(size=18)
    expected = plain_feet(tick, support, plan, before)
    np.testing.assert_allclose(SWING.feet(tick, support, plan, before), expected, rtol=1e-9, atol=1e-7)


def plain_accelerations(
    phase: int, support: np.ndarray, now: np.ndarray, plan: np.ndarray, after: np.ndarray
) -> np.ndarray:
    """Of the swing foot at k + 1 … k + H, shape (H, 2): the rest of this step, then swings of the coming foot."""
    rows, rest = [], PERIOD - 1 - phase
    coming = next((side for side in support[rest:] if side), 0)
    for i, side in enumerate(support):
        tick = phase + 1 + i
        if not side:
            rows.append(np.zeros(2))
        elif i >= rest:
            start, time = plan[1 if coming > 0 else 0, 1], (tick % PERIOD - LIFT_OFF) * TICK
            rows.append(swing_point(start, after, 0.0, DURATION, time).acceleration[:2])
        else:
            foot = 1 if side > 0 else 0
            if phase <= LIFT_OFF:
                rows.append(swing_point(*plan[foot], 0.0, DURATION, (tick - LIFT_OFF) * TICK).acceleration[:2])
            else:
                left = DURATION - (phase - LIFT_OFF) * TICK
                ends = zip(now[foot, :, :2].T, plan[foot, 1], strict=True)
                rows.append(np.array([quintic(state, end, left, (i + 1) * TICK)[2] for state, end in ends]))
    return np.array(rows)


@settings(deadline=None)
@given(
    st.integers(0, PERIOD - 1),
    st.sampled_from([(-1, 1, -1), (1, -1, 1), (0, -1, 1), (1, 0, 0), (0, 0, 0), (-1, 0, 1)]),
    st.integers(0, 2**32 - 1),
)
def test_the_accelerations_ahead_are_those_of_plain_numpy_clipped_and_added(
    phase: int, sides: tuple[int, int, int], seed: int
) -> None:
    random = np.random.default_rng(seed)
    now, plan, after = random.normal(size=(2, 3, 3)), random.normal(size=(2, 2, 2)), random.normal(size=2)
    support, factor, most = np.repeat(np.array(sides, dtype=float), PERIOD)[phase + 1 :][:80], (-0.002, 0.003), 0.05
    out = np.ones((2, 80))
    SWING.add_accelerations(phase, support, now, plan, after, factor, most, out)
    moved = np.clip(plain_accelerations(phase, support, now, plan, after) * factor, -most, most)
    np.testing.assert_allclose(out.T, 1.0 + moved, atol=1e-9)
