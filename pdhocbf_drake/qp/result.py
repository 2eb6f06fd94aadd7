"""What a solve of a quadratic program gives back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class QpResult(NamedTuple):
    """One quadratic program's answer.

    Attributes:
        ok: True only for a solver status of "optimal".
        decisions: the optimum, shape (n,); meaningless unless `ok`.
        cost: the optimal cost, parameters' constant part included.
        active: flags of the constraints active at the optimum, +1 upper, −1 lower, 0 inactive, shape (n_rows,).
        infeasible: True where the solver proved that no point meets the constraints.
        status: the solver's own word.
    """

    ok: bool
    decisions: np.ndarray
    cost: float
    active: np.ndarray
    infeasible: bool
    status: str
