"""The projection onto a polyhedron: its optimality conditions, and its proofs that there is none."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.barriers.projection import project


def problem(seed: int):
    """Unit rows of size 1, bounds and a target in a common unit; some rows parallel, opposed or repeated."""
    random = np.random.default_rng(seed)
    n, count, unit = int(random.integers(1, 5)), int(random.integers(0, 9)), 10.0 ** random.uniform(-9, 9)
    A = random.normal(size=(count, n)) if seed % 2 else random.integers(-1, 2, (count, n)) * 1.0
    A = A[np.any(A, axis=1)]
    A /= np.linalg.norm(A, axis=1)[:, None]
    return random.normal(size=n) * unit, A, (random.integers(-4, 3, len(A)) / 2 - 0.5) * unit, unit


def test_a_point_is_optimal_and_a_proof_proves():
    """KKT: x − target = Aᵀλ, λ ≥ 0, λ_i (a_i·x − b_i) = 0. Farkas: Aᵀy = 0, y ≥ 0, b·y > 0."""
    found = []
    for seed in range(1000):
        target, A, b, unit = problem(seed)
        point, proof = project(target, A, b)
        found.append(point is not None)
        if point is None:
            assert proof is not None, seed
            assert np.all(proof >= 0)
            assert np.abs(A.T @ proof).max() < 1e-9 * proof.max()
            assert b @ proof > 1e-9 * unit
            continue
        room = (A @ point - b) / unit
        assert room.min(initial=0.0) > -1e-12
        tight = A[room < 1e-9]
        # the point is also the projection onto the half-spaces that are tight, and the step lies in their cone
        step = point - target
        prices = np.linalg.lstsq(tight.T, step, rcond=None)[0] if len(tight) else np.zeros(0)
        assert np.abs(tight.T @ prices - step).max() < 1e-9 * unit
        for _ in range(20):  # no feasible direction leads nearer to the target
            way = np.random.default_rng(seed).normal(size=len(point))
            if np.all(tight @ way >= 0):
                assert step @ way >= -1e-9 * unit
    assert 0.3 < np.mean(found) < 0.95


def test_a_common_factor_on_bounds_and_target_is_one_on_the_point():
    for seed in range(100):
        target, A, b, unit = problem(seed)
        one, other = project(target, A, b), project(target / unit, A, b / unit)
        assert (one.point is None) == (other.point is None)
        if one.point is not None:
            assert one.point / unit == pytest.approx(other.point, abs=1e-12)
