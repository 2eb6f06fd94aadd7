"""Which solver answers a compiled program; everything works through Drake where DAQP is not installed."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Protocol

import numpy as np

from pdhocbf_drake.qp.compiled import ParametricQp
from pdhocbf_drake.qp.drake_solver import DrakeQp
from pdhocbf_drake.qp.result import QpResult


class QpSolver(Protocol):
    """Solves one `ParametricQp` at many θ; reads the solver's status before its answer and never raises on it."""

    def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult: ...


def make_solver(
    name: str, qp: ParametricQp, bound_rows: Sequence[str] = (), guess_rows: np.ndarray | None = None
) -> QpSolver:
    """ "daqp" where it is installed, else Drake's Clarabel.

    Args:
        name: "daqp" or "clarabel".
        qp: the compiled program.
        bound_rows: names of the rows that DAQP takes as variables, see `DaqpQp`.
        guess_rows: for each row, the row of the last tick's program whose activity DAQP starts from.
    """
    if name == "daqp" and has_daqp():
        from pdhocbf_drake.qp.daqp_solver import DaqpQp

        return DaqpQp(qp, bound_rows, guess_rows)
    return DrakeQp(qp)


def has_daqp() -> bool:
    """Whether the package `daqp` is installed."""
    return find_spec("daqp") is not None
