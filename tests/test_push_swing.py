"""A swing foot whose landing moves."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.walking import swing_point
from pdhocbf_drake.walking.swing import onward

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
    # What the foot moves in a tick is what its velocity says, to the second order of the tick.
    moved, said = np.diff(positions, axis=0), 0.5 * TICK * (velocities[1:] + velocities[:-1])
    assert abs(moved - said).max() < 3e-3
    np.testing.assert_allclose(points[-1], [end + shift, [0.0, 0.0], [0.0, 0.0]], atol=1e-12)


def test_the_polynomial_keeps_its_derivatives() -> None:
    now, end, step = np.array([[0.1], [0.7], [-3.0]]), np.array([0.25]), 1e-6
    here, there = (swing_onward(now, end, 0.2, ahead) for ahead in (0.05, 0.05 + step))
    np.testing.assert_allclose((there - here)[:2] / step, here[1:], rtol=1e-3)
    np.testing.assert_allclose(swing_onward(now, end, 0.2, 0.0), now, atol=1e-12)
