"""Invariant sets of systems with fixed states: flat ones, the limits of thin ones."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from pdhocbf_drake.barriers import PeriodicAffineSystem
from pdhocbf_drake.cli import main
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.sets import Polytope, invariant_set

CART = PeriodicAffineSystem([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]])
FORCE = [Polytope.box([-1.0], [1.0])]


def kept(low, high, inputs=FORCE, system=CART):
    return invariant_set(system, [Polytope.box(low, high)], inputs)


@pytest.mark.parametrize(
    ("low", "high", "fixed"),
    [([0.3, -9.0], [0.3, 9.0], 0), ([-1.0, 0.0], [1.0, 0.0], 1), ([0.0, -1e12], [0.0, 1e12], 0)],
)
def test_a_fixed_state_is_the_limit_of_thin_boxes(low, high, fixed):
    flat = kept(low, high).sets[0]
    assert flat.free == (1 - fixed,)
    errors = []
    for width in (1e-3, 1e-6, 1e-9):
        half = 0.5 * width * np.eye(2)[fixed]
        thin = kept(low - half, high + half).sets[0]
        errors.append(abs(thin.volume() / width - flat.volume()))
        assert thin.violation(flat.vertices).max() < 1e-9
    assert errors[0] < 0.05
    assert errors[1] < 1e-4
    assert errors[2] < 1e-6


def test_a_cart_that_stands_still_at_one_place_alternates_its_speed():
    # 0.1 v + 0.005 u = 0, so that v⁺ = v + 0.1 u = −v, and |v| ≤ 0.05 |u|.
    found = kept([0.3, -9.0], [0.3, 9.0]).sets[0]
    assert found.vertices[:, 0] == pytest.approx([0.3, 0.3], abs=1e-15)
    assert np.sort(found.vertices[:, 1]) == pytest.approx([-0.05, 0.05])
    assert found.volume() == pytest.approx(0.1)


def test_what_a_fixed_state_leaves_may_be_a_point():
    # Pushing to one side alone, the speed can't alternate; without the term in B it can't anyway.
    for found in (
        kept([0.0, -9.0], [0.0, 9.0], [Polytope.box([0.0], [1.0])]),
        kept([0.0, -9.0], [0.0, 9.0], system=PeriodicAffineSystem([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]])),
        kept([0.0, 0.0], [0.0, 0.0]),
    ):
        assert found.enforceable
        assert found.sets[0].rank == 0
        assert found.sets[0].vertices == pytest.approx(np.zeros((1, 2)), abs=1e-12)
        assert found.sets[0].volume() == 0.0
    assert not kept([0.0, -9.0], [0.0, 9.0], [Polytope.box([0.5], [1.0])]).enforceable


def random_problem(seed):
    """An unstable periodic system with a state that is fixed at some phases or at all."""
    random = np.random.default_rng(seed)
    n, m, period = int(random.integers(2, 4)), int(random.integers(1, 3)), int(random.integers(1, 4))
    A = np.array([np.eye(n) + 0.2 * random.normal(size=(n, n)) for _ in range(period)])
    low, high = -1.0 - random.random((period, n)), 1.0 + random.random((period, n))
    where = slice(None) if random.random() < 0.5 else 0
    fixed = int(random.integers(n))
    low[where, fixed] = high[where, fixed] = 0.1 * random.normal()
    return PeriodicAffineSystem(A, random.normal(size=(period, n, m))), low, high, -np.ones((1, m)), np.ones((1, m))


def farthest(system, states, inputs, direction, ticks):
    """The farthest x(0) along a direction from which the limits can be kept for some ticks: one linear program."""
    n, m, size = system.n, system.m, system.n + ticks * system.m
    on, rest = np.eye(n, size), np.zeros(n)
    rows, bounds = [states[0].A @ on], [states[0].b]
    for k in range(ticks):
        pick = np.eye(m, size, n + k * m)
        on, rest = system.A(k) @ on + system.B(k) @ pick, system.A(k) @ rest + system.c(k)
        limit = states[(k + 1) % system.period]
        rows += [inputs[0].A @ pick, limit.A @ on]
        bounds += [inputs[0].b, limit.b - limit.A @ rest]
    cost = -np.append(direction, np.zeros(ticks * m))
    found = linprog(cost, A_ub=np.vstack(rows), b_ub=np.concatenate(bounds), bounds=[(None, None)] * size)
    return -found.fun if found.status == 0 else None


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_flat_sets_are_those_of_a_linear_program_over_the_future_in_any_units(seed):
    random = np.random.default_rng(seed)
    system, low, high, push, pull = random_problem(seed)
    states, inputs = [Polytope.box(*box) for box in zip(low, high, strict=True)], [Polytope.box(push[0], pull[0])]
    try:
        found = invariant_set(system, states, inputs)
    except InputError:  # it converges too slowly
        reject()
    of_x, of_u = 10.0 ** random.uniform(-6, 6, system.n), 10.0 ** random.uniform(-6, 6, system.m)
    A, B = (np.array([part(k) for k in range(system.period)]) for part in (system.A, system.B))
    other = invariant_set(
        PeriodicAffineSystem(A * of_x[:, None] / of_x, B * of_x[:, None] / of_u),
        [Polytope.box(*box) for box in zip(low * of_x, high * of_x, strict=True)],
        [Polytope.box(push[0] * of_u, pull[0] * of_u)],
    )
    assert other.enforceable == found.enforceable
    for one, scaled in zip(found.sets, other.sets, strict=True):
        assert one.free == scaled.free
        assert one.violation(scaled.vertices / of_x).max() < 1e-7
    for direction in random.normal(size=(2, system.n)) if found.enforceable else ():
        expected = farthest(system, states, inputs, direction, min(30, found.sweeps * system.period))
        largest = (found.sets[0].vertices @ direction).max()
        assert largest <= expected + 1e-6
        if found.sweeps * system.period <= 30:
            assert largest == pytest.approx(expected, abs=1e-6)


def certify(folder, text, capsys):
    file = folder / "cart.yaml"
    file.write_text(f"A: [[1.0, 0.1], [0.0, 1.0]]\nB: [[0.005], [0.1]]\n{text}\n")
    assert main(["certify", str(file), "--out", str(folder / "out")]) == 0
    return capsys.readouterr().out, json.loads((folder / "out" / "certify.json").read_text())


def test_the_command_says_that_a_set_is_flat_and_which_states_are_free(tmp_path, capsys):
    states = "states: {lower: [0.3, -9.0], upper: [0.3, 9.0]}\ninputs: {lower: [-1.0], upper: [1.0]}"
    text, data = certify(tmp_path, states, capsys)
    assert "enforceable, found in 2 sweeps; volume 0.1 to 0.1; flat, of 1 instead of 2 dimensions" in text
    assert data["phases"][0]["free"] == [1]
    assert data["phases"][0]["area"] == pytest.approx(0.1)


def test_rows_that_are_an_equation_fix_a_direction(tmp_path, capsys):
    rows = "states: {lower: [-1, -9], upper: [1, 9], rows: [[1, 2], [-1, -2]], bounds: [0.1, -0.1]}"
    text, data = certify(tmp_path, f"{rows}\ninputs: {{lower: [-1.0], upper: [1.0]}}", capsys)
    assert "flat, of 1 instead of 2 dimensions" in text
    assert np.array(data["phases"][0]["vertices"]) @ [1.0, 2.0] == pytest.approx([0.1, 0.1])


def test_a_fixed_state_that_no_input_keeps_is_named(tmp_path, capsys):
    text, data = certify(
        tmp_path,
        "states: {lower: [-1.0, 0.2], upper: [1.0, 0.2]}\n"
        "inputs: [{lower: [-1.0], upper: [1.0]}, {lower: [0.5], upper: [0.6]}]",
        capsys,
    )
    assert "not enforceable: no input brings state 1 to 0.2, where it is fixed at phase 0" in text
    assert not data["enforceable"]
