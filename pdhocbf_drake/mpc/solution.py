"""What a solve of the periodic MPC gives back, and why it may be less than an optimum."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np


class Reason(IntEnum):
    """Why a tick's plan is what it is; logged as the last entry of `solver_status`."""

    SOLVED = 0
    SOFTENED = 1  # solved, and the barrier's slack is not zero
    CROSS_SOLVED = 2  # the first solver gave up, the second one solved it
    INFEASIBLE = 3  # no point meets the constraints: the last plan, shifted by a tick, is used
    NOT_OPTIMAL = 4  # the solver stopped for another reason: likewise
    BAD_MEASUREMENT = 5  # the measured state is not finite: the predicted one is used instead


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
