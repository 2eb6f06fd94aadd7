"""Which solver answers a compiled program; everything works through Drake where DAQP is not installed."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Protocol

import numpy as np

from pdhocbf_drake.mpc.compiled import ParametricQp
from pdhocbf_drake.mpc.drake_solver import DrakeQp
from pdhocbf_drake.mpc.solution import QpResult


class QpSolver(Protocol):
    """Solves one `ParametricQp` at many θ; reads the solver's status before its answer and never raises on it."""

    def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult: ...


def make_solver(name: str, qp: ParametricQp, bound_rows: Sequence[str]) -> QpSolver:
    """ "daqp" (with its bound rows made variables) where it is installed, else Drake's Clarabel."""
    if name == "daqp" and find_spec("daqp") is not None:
        from pdhocbf_drake.mpc.daqp_solver import DaqpQp

        return DaqpQp(qp, bound_rows)
    return DrakeQp(qp)
