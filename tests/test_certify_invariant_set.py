"""The maximal periodic controlled-invariant sets: they are invariant, they are maximal, and they shrink."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from pdhocbf_drake.barriers import PeriodicAffineSystem
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets.invariant_set import broken_phases, invariant_set
from pdhocbf_drake.sets.polytope import Polytope

seeds = st.integers(0, 2**32 - 1)


def random_problem(seed: int, period: int = 3):
    """An unstable periodic system with an input that pulls harder to one side than to the other."""
    random = np.random.default_rng(seed)
    A = np.array([np.eye(2) + 0.3 * random.normal(size=(2, 2)) for _ in range(period)])
    B, c = random.normal(size=(period, 2, 1)), 0.05 * random.normal(size=(period, 2))
    states = [Polytope.box([-1.0, -1.0 - 0.2 * k], [1.5, 1.0]) for k in range(period)]
    return PeriodicAffineSystem(A, B, c), states, [Polytope.box([-0.3], [0.6])]


def an_input(system, k, x, target, allowed):
    """Some admissible input that leads from x into the target, or None."""
    base = system.A(k) @ x + system.c(k)
    rows = np.vstack([allowed.A, target.A @ system.B(k)])
    bounds = np.concatenate([allowed.b, target.b - target.A @ base]) + 1e-7
    found = linprog(np.zeros(system.m), A_ub=rows, b_ub=bounds, bounds=[(None, None)] * system.m)
    return found.x if found.status == 0 else None


def can_be_kept(system, states, allowed, k, x, ticks=40):
    """An independent answer: one linear program over all inputs of a long future."""
    size = ticks * system.m
    rows, bounds, on, rest = [], [], np.zeros((system.n, size)), np.asarray(x, dtype=float)
    for i in range(ticks):
        block = np.zeros((len(allowed.A), size))
        block[:, i * system.m : (i + 1) * system.m] = allowed.A
        on, rest = system.A(k + i) @ on, system.A(k + i) @ rest + system.c(k + i)
        on[:, i * system.m : (i + 1) * system.m] += system.B(k + i)
        limit = states[(k + i + 1) % system.period]
        rows += [block, limit.A @ on]
        bounds += [allowed.b, limit.b - limit.A @ rest]
    found = linprog(np.zeros(size), A_ub=np.vstack(rows), b_ub=np.concatenate(bounds), bounds=[(None, None)] * size)
    return found.status == 0


@settings(max_examples=8, deadline=None)
@given(seeds)
def test_from_every_vertex_an_input_leads_into_the_next_set(seed):
    system, states, inputs = random_problem(seed)
    found = invariant_set(system, states, inputs)
    for k, part in enumerate(found.sets):
        target = found.sets[(k + 1) % system.period]
        assert all(an_input(system, k, x, target, inputs[0]) is not None for x in part.vertices)
        assert states[k].violation(part.vertices).max() < 1e-9


@settings(max_examples=10, deadline=None)
@given(seeds)
@example(591)  # one that is lost after more than sixty ticks
def test_states_outside_can_not_be_kept(seed):
    system, states, inputs = random_problem(seed)
    found = invariant_set(system, states, inputs)
    random = np.random.default_rng(seed)
    for _ in range(5):
        k = int(random.integers(system.period))
        x = random.uniform(states[k].vertices.min(axis=0), states[k].vertices.max(axis=0))
        outside = not found.enforceable or found.sets[k].violation(x) > 1e-3
        if outside:
            # A state just outside is lost only after as many ticks as the iteration took.
            ahead = max(40, found.sweeps * system.period)
            assert not can_be_kept(system, states, inputs[0], k, x, ahead)
        elif found.sets[k].violation(x) < -1e-6:
            assert can_be_kept(system, states, inputs[0], k, x)


def test_the_set_of_a_double_integrator_holds_the_states_that_can_still_brake():
    # With full braking from the first tick on, x stays below 1 iff x + jδv − (jδ)²/2 ≤ 1 for all j; and mirrored, with
    # the weaker input to the other side.
    tick, brake, push = 0.1, 1.0, 0.5
    system = PeriodicAffineSystem([[1.0, tick], [0.0, 1.0]], [[tick**2 / 2], [tick]])
    found = invariant_set(system, [Polytope.box([-1.0, -9.0], [1.0, 9.0])], [Polytope.box([-brake], [push])])
    time = tick * np.arange(60)
    ahead, behind = np.column_stack([np.ones(60), time]), -np.column_stack([np.ones(60), time])
    expected = Polytope.from_rows(
        np.vstack([ahead, behind]), np.concatenate([1.0 + brake * time**2 / 2, 1.0 + push * time**2 / 2])
    )
    assert expected is not None
    assert expected.violation(found.sets[0].vertices).max() < 1e-9
    assert found.sets[0].violation(expected.vertices).max() < 1e-9
    assert found.sets[0].volume() == pytest.approx(expected.volume())


@settings(max_examples=10, deadline=None)
@given(seeds, st.floats(0.01, 0.4))
def test_a_tighter_limit_never_enlarges_a_set(seed, cut):
    system, states, inputs = random_problem(seed)
    loose = invariant_set(system, states, inputs)
    tighter = [Polytope.from_rows(np.vstack([s.A, [[1.0, 0.5]]]), np.append(s.b, 1.0 - cut)) for s in states]
    tight = invariant_set(system, [part for part in tighter if part is not None], inputs)
    if tight.enforceable:
        assert loose.enforceable
        for inner, outer in zip(tight.sets, loose.sets, strict=True):
            assert outer.violation(inner.vertices).max() < 1e-7
            assert inner.volume() <= outer.volume() + 1e-7  # vertices agree to 1e-7, and a set here is about 2 across


def test_with_too_weak_an_input_there_is_no_set_and_the_phase_is_named():
    # x⁺ = 2x + u + 3 cannot stay within ±1 with |u| ≤ 1.
    found = invariant_set(
        PeriodicAffineSystem([[2.0]], [[1.0]], [3.0]), [Polytope.box([-1.0], [1.0])], [Polytope.box([-1.0], [1.0])]
    )
    assert not found.enforceable
    assert found.first_failing_phase == 0
    assert not found.sets


def test_one_dimension_by_hand():
    # x⁺ = 2x + u with |u| ≤ 1: the fixed points of the worst case are ±1.
    found = invariant_set(
        PeriodicAffineSystem([[2.0]], [[1.0]]), [Polytope.box([-5.0], [5.0])], [Polytope.box([-1.0], [1.0])]
    )
    assert found.sets[0].vertices.ravel() == pytest.approx([-1.0, 1.0], abs=1e-8)


def test_state_matrices_need_not_be_invertible():
    # The second state is the last choice, independent of the one before.
    system = PeriodicAffineSystem([[1.2, 1.0], [0.0, 0.0]], [[0.0], [1.0]])
    found = invariant_set(system, [Polytope.box([-1.0, -0.5], [1.0, 0.5])], [Polytope.box([-0.5], [0.5])])
    assert found.enforceable
    for x in found.sets[0].vertices:
        assert an_input(system, 0, x, found.sets[0], Polytope.box([-0.5], [0.5])) is not None


def test_a_time_invariant_system_has_the_period_of_its_limits():
    A, B = [[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]]
    limits = [Polytope.box([-1.0, -9.0], [high, 9.0]) for high in (0.8, 1.0)]
    push = [Polytope.box([-1.0], [1.0])]
    once, twice = (invariant_set(PeriodicAffineSystem(*both), limits, push) for both in ((A, B), ([A] * 2, [B] * 2)))
    assert once.sweeps == twice.sweeps
    for one, other in zip(once.sets, twice.sets, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)


def test_limits_that_do_not_fit_are_refused():
    system = PeriodicAffineSystem(np.eye(2), np.ones((2, 1)))
    box, inputs = Polytope.box([-1.0, -1.0], [1.0, 1.0]), Polytope.box([-1.0], [1.0])
    with pytest.raises(InputError, match="the input limits must have 1 dimensions, given 2"):
        invariant_set(system, [box], [box])
    with pytest.raises(InputError, match="the input limits need 1 polytope or one for each of 3 phases, given 2"):
        invariant_set(system, [box] * 3, [inputs] * 2)
    with pytest.raises(InputError, match="no invariant set was found within 1 sweeps"):
        invariant_set(PeriodicAffineSystem([[2.0]], [[1.0]]), [Polytope.box([-5.0], [5.0])], [inputs], max_sweeps=1)


def test_phases_are_broken_where_some_vertex_has_no_input_into_the_next_part():
    system, states, inputs = random_problem(1)
    expected = [
        any(an_input(system, k, x, states[(k + 1) % 3], inputs[0]) is None for x in states[k].vertices)
        for k in range(3)
    ]
    assert any(expected)
    assert broken_phases(system, states, inputs * 3) == tuple(np.flatnonzero(expected))


def test_an_invariant_set_breaks_nowhere_and_an_empty_part_breaks_its_own_phase_and_the_one_before():
    system, states, inputs = random_problem(1)
    found = invariant_set(system, states, inputs)
    assert found.enforceable
    assert broken_phases(system, found.sets, inputs * 3) == ()
    assert broken_phases(system, (found.sets[0], None, found.sets[2]), inputs * 3) == (0, 1)
