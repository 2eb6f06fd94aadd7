"""Compiled loops beside references of a few lines: what the tests of every `kernels.py` share."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
from numba.core.registry import CPUDispatcher

Values = tuple[object, ...]
Case = Callable[[np.random.Generator], tuple[Values, Values]]
"""Runs a kernel and its reference on random arrays: what both return and write."""


def by_name(*cases: Case) -> dict[str, Case]:
    """The cases by the names of their kernels."""
    return {case.__name__: case for case in cases}


def kernels_of(module: ModuleType) -> set[str]:
    """The names of the module's compiled functions."""
    return {name for name, value in vars(module).items() if isinstance(value, CPUDispatcher)}


def assert_agreement(case: Case, tolerance: float) -> None:
    """Fails unless kernel and reference agree for each of 30 seeds, relatively and absolutely within a tolerance."""
    for seed in range(30):
        found, expected = case(np.random.default_rng(seed))
        for ours, theirs in zip(found, expected, strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=tolerance, atol=tolerance, err_msg=f"seed {seed}")
