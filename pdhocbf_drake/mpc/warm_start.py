"""Where the last tick's active set stands in this tick's program."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from pdhocbf_drake.qp import ParametricQp

_ONE_PER_STEP = ("step_lower", "step_upper")


def guess_rows(qps: Sequence[ParametricQp], phase: int) -> np.ndarray:
    """For each row of `qps[phase]`, the row of the phase before that speaks of the same instant or step, shape (m,).

    The i-th row of a constraint over the horizon is about tick k + i, so that its place was one later a tick ago;
    the last one, which is new, takes over from its neighbour. Rows about coming steps move at a new step only.
    """
    return _rows(qps[phase - 1].names, qps[phase].names, phase == 0)


@lru_cache(maxsize=8)  # most phases have rows of the same names
def _rows(names_before: tuple[str, ...], names: tuple[str, ...], new_step: bool) -> np.ndarray:
    before: dict[str, list[int]] = {}
    for row, name in enumerate(names_before):
        before.setdefault(name, []).append(row)
    seen: dict[str, int] = {}
    rows = np.arange(len(names)) % max(len(names_before), 1)
    for row, name in enumerate(names):
        place = seen[name] = seen.get(name, -1) + 1
        shift = 1 if name not in _ONE_PER_STEP or new_step else 0
        if name in before:
            rows[row] = before[name][min(place + shift, len(before[name]) - 1)]
    return rows
