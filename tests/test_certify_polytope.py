"""Polytopes by facets and vertices at once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.polytope import Polytope

seeds = st.integers(0, 2**32 - 1)


def random_polytope(seed: int, n: int) -> Polytope:
    points = np.random.default_rng(seed).normal(size=(4 * n + 4, n))
    polytope = Polytope.from_vertices(points)
    assert polytope is not None
    return polytope


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(1, 4))
def test_rows_and_vertices_describe_the_same_set(seed, n):
    polytope = random_polytope(seed, n)
    assert np.allclose(polytope.violation(polytope.vertices), 0.0, atol=1e-9)
    again = Polytope.from_rows(polytope.A, polytope.b)
    assert again is not None
    assert again.volume() == pytest.approx(polytope.volume(), rel=1e-9)
    assert polytope.violation(again.vertices).max() < 1e-9


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(1, 3))
def test_the_sum_has_the_sum_of_the_supports(seed, n):
    random = np.random.default_rng(seed)
    one, points, direction = random_polytope(seed, n), random.normal(size=(3, n)), random.normal(size=n)
    support = (one.vertices @ direction).max() + (points @ direction).max()
    assert (one.swept(points).vertices @ direction).max() == pytest.approx(support)


def test_redundant_rows_are_dropped():
    eye = np.eye(2)
    rows = np.vstack([eye, -eye, eye, [[1.0, 1.0]]])
    square = Polytope.from_rows(rows, [1, 1, 1, 1, 5, 5, 9])
    assert square is not None
    assert len(square.A) == 4
    assert square.volume() == pytest.approx(4.0)


def test_contradicting_rows_have_no_polytope():
    assert Polytope.from_rows([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]], [0.0, -1.0, 1.0, 1.0]) is None
    assert Polytope.from_rows([[0.0, 0.0], [1.0, 0.0]], [-1.0, 1.0]) is None


def test_unbounded_rows_are_refused():
    with pytest.raises(InputError, match="a polytope must be bounded: limit every state, if only loosely"):
        Polytope.from_rows([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]], [1.0, 1.0, 1.0])


def test_slice_and_shadow_of_a_pyramid():
    pyramid = Polytope.from_vertices([[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0], [0, 0, 1]])
    assert pyramid is not None
    half = pyramid.slice(0.5)
    assert half is not None
    assert half.volume() == pytest.approx(1.0)
    assert pyramid.slice(1.5) is None
    assert pyramid.shadow(2).volume() == pytest.approx(4.0)


def test_a_box_may_be_flat_but_not_empty():
    with pytest.raises(InputError, match="a box needs finite limits with lower ≤ upper"):
        Polytope.box([0.0, 2.0], [1.0, 1.0])
    flat = Polytope.box([0.0, 1.0, -1.0], [2.0, 1.0, 1.0])
    assert flat.free == (0, 2)
    assert flat.volume() == pytest.approx(4.0)
    assert Polytope.box([3.0], [3.0]).vertices.tolist() == [[3.0]]


def test_the_outline_of_a_polygon_turns_one_way_through_every_vertex():
    polygon = Polytope.from_vertices(np.random.default_rng(3).normal(size=(40, 2)) * [1.0, 1e-3])
    outline = polygon.outline
    assert sorted(map(tuple, outline)) == sorted(map(tuple, polygon.vertices))
    edges = np.roll(outline, -1, axis=0) - outline
    following = np.roll(edges, -1, axis=0)
    assert np.all(edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0] > 0.0)


def test_samples_lie_inside_and_on_either_side_of_the_centre():
    polytope = Polytope.from_vertices(np.random.default_rng(4).normal(size=(30, 3)))
    random = np.random.default_rng(5)
    points = np.array([polytope.sample(random) for _ in range(200)])
    assert polytope.violation(points).max() <= 0.0
    assert np.all(points.min(axis=0) < polytope.centre)
    assert np.all(points.max(axis=0) > polytope.centre)
