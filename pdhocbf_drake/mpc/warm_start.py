"""Where the last tick's active set stands in this tick's program."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdhocbf_drake.mpc.compiled import ParametricQp

_ONE_PER_STEP = ("step_lower", "step_upper")


def guess_rows(qps: Sequence[ParametricQp], phase: int) -> np.ndarray:
    """For each row of `qps[phase]`, the row of the phase before that speaks of the same instant or step, shape (m,).

    The i-th row of a constraint over the horizon is about tick k + i, so that its place was one later a tick ago;
    the last one, which is new, takes over from its neighbour. Rows about coming steps move at a new step only.
    """
    before: dict[str, list[int]] = {}
    for row, name in enumerate(qps[phase - 1].names):
        before.setdefault(name, []).append(row)
    seen: dict[str, int] = {}
    rows = np.arange(len(qps[phase].A)) % max(len(qps[phase - 1].A), 1)
    for row, name in enumerate(qps[phase].names):
        place = seen[name] = seen.get(name, -1) + 1
        shift = 1 if name not in _ONE_PER_STEP or phase == 0 else 0
        if name in before:
            rows[row] = before[name][min(place + shift, len(before[name]) - 1)]
    return rows
