"""A proof that a state is lost, independent of the sets: a linear program over a long future."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array, lil_array

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.studies.shared.stepping_template import SteppingTemplate

SAVED = 1e-6
"""A larger excess proves that a state is lost; a smaller one may be the solver's tolerance [m, m/s]."""


class Rescue:
    """The least excess t over the limits within T ticks from a state, over all choices of ZMP and footholds.

    The variables are the CoM c_i in the world, its velocity v_i, the ZMP p_i and the footholds f_j of the coming steps:

        c_{i+1} = c_i + δ v_i,   v_{i+1} = v_i + δ eta_i (c_i − p_i),   |c_i − f| ≤ reach,   h_i ≥ 0,
        |p_i − ((1 − w_i) f₋ + w_i f)| ≤ half,   shortest ≤ f − f₋ ≤ longest,

    with all of these inequalities relaxed by one t ≥ 0, which is minimised. t > 0 proves that the state is lost; t = 0
    proves that it can be saved for T ticks. The program is derived from the walk, in world coordinates, and not from
    the matrices from which the sets are computed.
    """

    def __init__(
        self, template: SteppingTemplate, barriers: Sequence[AffineBarrier], reach: float, phase: int, ticks: int = 400
    ) -> None:
        steps_per_period = template.period // template.ticks_per_step
        start, n = phase % template.period, template.ticks_per_step
        later = (start + ticks) // n - start // n  # steps that begin within the horizon
        self._coming, self._held = bool(template.coming[start]), float(template.held[start])
        size = 3 * ticks + 2 + later + 3  # c, v: T + 1 each, p: T, then f₋, f, f_1, …, and t
        c, v, p = np.arange(ticks + 1), ticks + 1 + np.arange(ticks + 1), 2 * ticks + 2 + np.arange(ticks)
        feet = size - later - 3 + np.arange(later + 2)
        delta = template.tick
        equal = lil_array((2 * ticks, size))
        upper: list[tuple[dict[int, float], float]] = []
        for i in range(ticks + 1):
            k = start + i
            ahead = k // n - start // n
            last, now = int(feet[ahead]), int(feet[ahead + 1])
            q = k % template.period
            if i < ticks:
                eta, w = template.eta[q], template.weights[q]
                equal[2 * i, [c[i + 1], c[i], v[i]]] = [1.0, -1.0, -delta]
                equal[2 * i + 1, [v[i + 1], v[i], c[i], p[i]]] = [1.0, -1.0, -delta * eta, delta * eta]
                for sign in (1.0, -1.0):
                    row = {int(p[i]): sign, last: -sign * (1 - w), now: -sign * w}
                    upper.append((row, template.half))
            for sign in (1.0, -1.0):
                upper.append(({int(c[i]): sign, now: -sign}, reach))
            for barrier in barriers:
                on_com, on_velocity, on_zmp = barrier.sign * barrier.normals(k, 1)[0]
                row = {int(c[i]): on_com, now: -on_com - on_zmp, int(v[i]): on_velocity}
                if on_zmp:
                    if i == ticks:
                        continue  # the plan has no ZMP there
                    row[int(p[i])] = on_zmp
                upper.append((row, barrier.sign * barrier.bound(k)))
        for j in range(1, later + 1):
            low, high = template.steps[((start // n + j - 1) % steps_per_period) * n]
            row = {int(feet[j + 1]): 1.0, int(feet[j]): -1.0}
            upper += [(row, high), ({column: -value for column, value in row.items()}, -low)]
        inequality = lil_array((len(upper), size))
        for index, (row, _) in enumerate(upper):
            inequality[index, size - 1] = -1.0
            for column, value in row.items():
                inequality[index, column] += value
        self._equal, self._inequality = csr_array(equal), csr_array(inequality)
        self._bounds = np.array([bound for _, bound in upper])
        self._given = [int(c[0]), int(v[0])]
        self._feet = feet

    def excess(self, state: Array) -> float:
        """t from [c, v] or [c, v, s], c from the stance foot and s the step chosen last, else the commanded one.

        t is in m for a position, in m/s for a velocity; raises `PdhocbfError` if the program can't be solved.
        """
        size = self._equal.shape[1]
        limits: list[tuple[float | None, float | None]] = [(None, None)] * size
        limits[-1] = (0.0, None)
        step = float(state[2]) if len(state) == 3 else self._held
        fixed = {self._given[0]: float(state[0]), self._given[1]: float(state[1]), int(self._feet[1]): 0.0}
        # Where the coming step is chosen already, the last one has no effect.
        fixed[int(self._feet[0])] = 0.0 if self._coming else -step
        if self._coming and len(self._feet) > 2:
            fixed[int(self._feet[2])] = step
        for column, value in fixed.items():
            limits[column] = (value, value)
        result = linprog(
            np.eye(1, size, size - 1)[0], A_ub=self._inequality, b_ub=self._bounds, A_eq=self._equal,
            b_eq=np.zeros(self._equal.shape[0]), bounds=limits, method="highs",
        )  # fmt: skip
        if result.status != 0:
            raise PdhocbfError(f"the rescue program ended with: {result.message}")
        return float(result.fun)
