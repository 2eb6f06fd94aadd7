"""Boxes of the stance frame: what of a box is left along axes that are turned."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis.strategies import floats, lists

from pdhocbf_drake.walking.frame import inner_box, inner_share, rotation

SIDES = lists(floats(0.0, 0.1), min_size=4, max_size=4)
ANGLES = floats(0.01, 1.5) | floats(-1.5, -0.01)


def is_inside(least: np.ndarray, most: np.ndarray, low: np.ndarray, high: np.ndarray, angle: float) -> bool:
    """Whether the box [least, most], turned, is inside [low, high]."""
    corners = np.array([[x, y] for x in (least[0], most[0]) for y in (least[1], most[1])]) @ rotation(angle).T
    return bool(np.all(corners >= low - 1e-12) and np.all(corners <= high + 1e-12))


def larger(least: np.ndarray, most: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, int, int]]:
    """The box with each of its sides moved out a little, and which side of which axis that is."""
    for axis in (0, 1):
        for side, outward in ((0, -1e-6), (1, 1e-6)):
            box = np.array([least, most])
            box[side, axis] += outward
            yield box[0], box[1], side, axis


@pytest.mark.parametrize("angle", [0.2, -0.7, 1.5])
def test_the_similar_box_is_the_largest_one(angle: float) -> None:
    low, high = np.array([-0.1, -0.02]), np.array([0.08, 0.06])
    share = inner_share(low, high, angle)
    assert is_inside(share * low, share * high, low, high, angle)
    assert not is_inside(1.001 * share * low, 1.001 * share * high, low, high, angle)


@given(SIDES, ANGLES)
def test_a_box_inside_holds_the_similar_one_and_no_side_of_it_can_go_out(limits: list[float], angle: float) -> None:
    low, high = -np.array(limits[:2]), np.array(limits[2:])
    (least, most), share = inner_box(low, high, angle), inner_share(low, high, angle)
    assert is_inside(least, most, low, high, angle)
    assert np.all(least <= share * low) and np.all(most >= share * high)
    for less, more, side, axis in larger(least, most):
        limit = (-low, high)[side][axis]
        assert not is_inside(less, more, low, high, angle) or (-less, more)[side][axis] > limit


@given(floats(0.05, 1.5), floats(0.02, 0.1))
def test_a_box_about_a_point_on_an_edge_goes_to_one_side_of_it(angle: float, size: float) -> None:
    low, high = np.array([-size, 0.0]), np.array([size, size])
    least, most = inner_box(low, high, angle)
    assert inner_share(low, high, angle) == 0.0
    assert np.all(most - least > 0.5 * size * np.sin(angle) * np.cos(angle))
    mirrored = inner_box(low, high, -angle)
    np.testing.assert_allclose(mirrored[0], [-most[0], least[1]], atol=1e-15)
    np.testing.assert_allclose(mirrored[1], [-least[0], most[1]], atol=1e-15)
