"""The programs of a tick: all limits kept, or those of torque and ground exceeded by as little as can be."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.whole_body.reason import SOFTENED
from pdhocbf_drake.whole_body.solver import Program

_SLACK = 1e4  # price of a limit's whole as slack, linear, beside squared accelerations [m²/s⁴]


class Use(NamedTuple):
    """What a motion uses of its limits, low ≤ use ≤ high, see `kernels.write_use`.

    Attributes:
        use, low, high: (m,).
        kinds: the `Reason` of each row that may be softened, 0 for the joints' accelerations (m,).
        worst: by how much a limit of torque, speed or ground is exceeded, negative where none is.
        stopped: by how much the barrier on a joint's angle is, likewise.
        outside: by how much a sole's centre of pressure is beyond an edge, likewise.
    """

    use: np.ndarray
    low: np.ndarray
    high: np.ndarray
    kinds: np.ndarray
    worst: float
    stopped: float
    outside: float


class Bounded(NamedTuple):
    """Decisions y, their cost ½ yᵀ H y, and bounds of them, H (n, n), low and high (n,)."""

    hessian: np.ndarray
    low: np.ndarray
    high: np.ndarray


def hard_program(use: Use, rows: np.ndarray, decisions: Bounded) -> Program:
    """The cheapest decisions with low ≤ use + rows y ≤ high; rows (m, n)."""
    hessian, low, high = decisions
    lower, upper = np.concatenate([low, use.low - use.use]), np.concatenate([high, use.high - use.use])
    return Program(hessian, np.zeros(len(low)), rows, lower, upper)


def soft_program(use: Use, rows: np.ndarray, decisions: Bounded) -> Program:
    """The same with a slack for each of `SOFTENED`, in that order behind the decisions; the joints' rows stay hard."""
    hessian, low, high = decisions
    count, kinds = len(low), len(SOFTENED)
    below, above = use.low - use.use, use.high - use.use
    slack = (use.kinds[:, None] == np.array(SOFTENED)).astype(float)
    hard = use.kinds == 0
    down, up = np.isfinite(below), np.isfinite(above) & ~hard  # a hard row has both bounds in one
    table = np.vstack([np.hstack([rows, slack])[down], np.hstack([rows, -slack])[up]])
    nowhere = np.full(len(below), np.inf)
    lower = np.concatenate([below[down], -nowhere[up]])
    upper = np.concatenate([np.where(hard, above, nowhere)[down], above[up]])
    both = np.eye(count + kinds)
    both[:count, :count] = hessian
    return Program(
        both,
        np.concatenate([np.zeros(count), np.full(kinds, _SLACK)]),
        table,
        np.concatenate([low, np.zeros(kinds), lower]),
        np.concatenate([high, np.full(kinds, np.inf), upper]),
    )
