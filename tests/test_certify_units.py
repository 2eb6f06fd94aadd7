"""Polytopes and invariant sets in any units, and systems of a file with fixed inputs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.barriers import PeriodicAffineSystem
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.invariant_set import invariant_set
from pdhocbf_drake.sets.polytope import Polytope, bounding_box
from pdhocbf_drake.sets.user_system import LinearSystemConfig

BOX = {"lower": [-1.0, -9.0], "upper": [1.0, 9.0]}


def certified(position=1.0, speed=1.0, force=1.0, states=None, inputs=None):
    """A cart in other units of its position, speed and force, with less force at every second tick."""
    states, inputs = states or BOX, inputs or [(-1.0, 1.0), (-0.5, 0.5)]
    data = {
        "A": [[1.0, 0.1 * position / speed], [0.0, 1.0]],
        "B": [[0.005 * position / force], [0.1 * speed / force]],
        "states": {side: [limits[0] * position, limits[1] * speed] for side, limits in states.items()},
        "inputs": [{"lower": [low * force], "upper": [high * force]} for low, high in inputs],
    }
    return LinearSystemConfig.from_dict(data, "cart").certify()


@pytest.mark.parametrize(
    "units", [(1e-9, 1e-9, 1.0), (1e9, 1e9, 1.0), (1.0, 1.0, 1e-9), (1e9, 1e-9, 1e9), (1e-9, 1e9, 1.0)]
)
def test_units_of_states_and_inputs_scale_the_sets_and_change_nothing_else(units):
    position, speed, _ = units
    expected, found = certified(), certified(*units)
    assert found.sweeps == expected.sweeps
    for one, other in zip(found.sets, expected.sets, strict=True):
        assert other.volume() * position * speed == pytest.approx(one.volume(), rel=1e-9)
        assert other.violation(one.vertices / [position, speed]).max() < 1e-9


def test_a_small_box_far_from_the_origin_is_none_the_less_a_box():
    box = Polytope.box([1e3, -1.0], [1e3 + 1e-6, 1.0])
    assert box.volume() == pytest.approx(2e-6, rel=1e-6)
    assert len(box.A) == 4


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_rows_in_other_units_have_the_vertices_in_other_units(seed, n):
    random = np.random.default_rng(seed)
    unit, shift = 10.0 ** random.uniform(-9, 9, n), random.normal(size=n)
    polytope = Polytope.from_vertices(random.normal(size=(4 * n + 4, n)) + shift)
    assert polytope is not None
    rows = polytope.A / unit * 10.0 ** random.uniform(-3, 3, len(polytope.A))[:, None]
    other = Polytope.from_rows(rows, (rows * unit / polytope.A)[:, 0] * polytope.b)
    assert other is not None
    assert len(other.vertices) == len(polytope.vertices)
    assert polytope.violation(other.vertices / unit).max() < 1e-9
    low, high = bounding_box(polytope.A, polytope.b)
    assert low == pytest.approx(polytope.vertices.min(axis=0), rel=1e-9, abs=1e-9)
    assert high == pytest.approx(polytope.vertices.max(axis=0), rel=1e-9, abs=1e-9)


def test_a_fixed_input_is_the_limit_of_narrow_ones():
    fixed, narrow = (certified(inputs=[(-1.0, 1.0), (0.2 - half, 0.2 + half)]) for half in (0.0, 1e-9))
    assert fixed.enforceable
    for one, other in zip(fixed.sets, narrow.sets, strict=True):
        assert one.volume() == pytest.approx(other.volume(), rel=1e-7)
    assert certified(inputs=[(-1.0, 1.0), (0.0, 0.0)]).sets[0].volume() < certified().sets[0].volume()


def test_limits_that_leave_nothing_are_refused():
    with pytest.raises(InputError, match=r"system.states.0: the limits leave nothing"):
        certified(states={"lower": [1.0, -1.0], "upper": [0.0, 1.0]})
    with pytest.raises(InputError, match=r"system.inputs.1: the limits leave nothing"):
        certified(inputs=[(-1.0, 1.0), (1.0, -1.0)])
    half = {"A": [[2.0]], "B": [[1.0]], "states": {"rows": [[1.0]], "bounds": [1.0]}}
    with pytest.raises(InputError, match=r"system.states.0: a polytope must be bounded: limit every state"):
        LinearSystemConfig.from_dict({**half, "inputs": {"lower": [-1.0], "upper": [1.0]}}, "cart").certify()


@pytest.mark.parametrize("loose", [1e6, 1e9, 1e12])
def test_a_limit_that_others_imply_makes_no_difference(loose):
    expected = certified().sets[0]
    found = certified(states={"lower": [-1.0, -loose], "upper": [1.0, loose]}).sets[0]
    assert found.volume() == pytest.approx(expected.volume(), rel=1e-9)


def test_the_speed_that_a_thin_box_implies_is_resolved():
    # x⁺ = x + 0.1 v within ±w, so that |v| ≤ 20 w from one side to the other; its own limit of 9 is a loose one.
    system = PeriodicAffineSystem([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]])
    for width in (1e-6, 1e-9, 1e-12):
        found = invariant_set(system, [Polytope.box([-width, -9.0], [width, 9.0])], [Polytope.box([-1.0], [1.0])])
        assert found.sets[0].volume() == pytest.approx(40.0 * width**2, rel=1e-6)
