"""Problem (36) of one axis: its terms, what they write, and θ, what changes from tick to tick."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import lru_cache
from math import lcm

import numpy as np

from pdhocbf_drake.mpc.config import SENSING
from pdhocbf_drake.mpc.kernels import write_common
from pdhocbf_drake.mpc.plan import NOTICED
from pdhocbf_drake.mpc.terms import TERMS
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import RowKind, Setting, Term, Tick
from pdhocbf_drake.qp import ParametricQp, compile_program

_NONE = np.zeros((2, 0))


class AxisProblem:
    """The terms of one axis, and all that is asked of them together.

    θ begins with what several terms share: state [c, v, p]; stance (centres of the last and this step's box); and
    zmp_offset (expected real minus template ZMP at k + 1 … k + H). The parameters of each term follow.

    Attributes:
        setting: what the terms are made from.
        terms: in the order in which they are written.
        places: where each parameter lies in θ, by name.
        size: length of θ.
        row_kinds: what holds for the rows of each name.
        period: after how many ticks its programs repeat: a step, or a gait where a term says so.
    """

    def __init__(self, setting: Setting, kinds: Sequence[type[Term]] = TERMS) -> None:
        self._settle(setting, [term for kind in kinds for term in kind.of(setting)])

    def _settle(self, setting: Setting, terms: list[Term]) -> None:
        self.setting, self.terms = setting, terms
        sizes = {"state": 3, "stance": 2, "zmp_offset": setting.config.horizon}  # in the order of `write_common`
        self.row_kinds: dict[str, RowKind] = {}
        for term in self.terms:
            sizes |= term.sizes
            self.row_kinds |= term.row_kinds
        self.places = layout(sizes)
        self.period = lcm(setting.gait.period, *(term.period for term in terms))
        self.size = sum(sizes.values())
        for term in self.terms:
            term.places = {name: self.places[name] for name in term.sizes}
        self._axis = setting.axis
        self._fill = [term.fill_tick for term in self.terms if type(term).fill_tick is not Term.fill_tick]
        self._of_step = lru_cache(maxsize=4)(self._step_parameters)

    @property
    def bound_rows(self) -> list[str]:
        """Names of the rows that a solver may take as variables."""
        return [name for name, kind in self.row_kinds.items() if kind.is_bound]

    @property
    def key(self) -> Hashable:
        """What its programs depend on; problems with equal keys have equal programs."""
        setting = self.setting
        # What is left out is in θ, in other problems, or before and after them.
        config = setting.config.model_dump_json(exclude={"recovery", "robust", *SENSING})
        matrices = (setting.gait.region.weight.tobytes(), setting.vhip.A.tobytes(), setting.vhip.B.tobytes())
        return config, matrices, tuple(term.key for term in self.terms)

    def changed(self, change: Callable[[Term], Term]) -> AxisProblem:
        """The problem with every term changed, for the same θ."""
        other = AxisProblem.__new__(AxisProblem)
        other._settle(self.setting, [change(term) for term in self.terms])
        return other

    def write(self, tick: int) -> AxisProgram:
        """The program for this tick of a gait."""
        setting = self.setting
        program = AxisProgram(setting.gait, setting.vhip, tick, setting.config.horizon, self.places)
        for term in self.terms:
            term.write(program)
        return program

    def compile(self, tick: int) -> ParametricQp:
        """The same, compiled."""
        program = self.write(tick)
        return compile_program(program.prog, program.decisions, program.parameters)

    def theta(self, tick: Tick) -> np.ndarray:
        """θ at a tick, shape (size,)."""
        theta, offset = np.empty(self.size), _NONE if tick.zmp_offset is None else tick.zmp_offset
        write_common(self._of_step(tick.step), self._axis, tick.state, tick.stance, offset, theta)
        for fill in self._fill:
            fill(tick, theta)
        return theta

    def _step_parameters(self, step: int) -> np.ndarray:
        """What holds all through a step; zero elsewhere."""
        theta, ahead = np.zeros(self.size), self.setting.commanded.steps(step)
        for term in self.terms:
            term.fill_step(step, ahead, theta)
        return theta

    def slack_starts(self) -> np.ndarray:
        """Where the slacks of each term that has some begin among all slacks."""
        counts = [count for term in self.terms if (count := term.slacks)]
        return np.cumsum([0, *counts])[: len(counts)]

    def guess_rows(self, qps: Sequence[ParametricQp], tick: int) -> np.ndarray:
        """For each row of `qps[tick]`, the row of the tick before that was about the same instant or step, (m,).

        The i-th row of a name over the horizon is about tick k + i, so that a tick ago it was the next one; the last,
        which is new, takes over from its neighbour. Rows about coming steps move at a new step only.
        """
        before: dict[str, list[int]] = {}
        for row, name in enumerate(qps[tick - 1].names):
            before.setdefault(name, []).append(row)
        count: dict[str, int] = {}
        names = qps[tick].names
        rows = np.arange(len(names)) % max(len(qps[tick - 1].names), 1)
        for row, name in enumerate(names):
            place = count[name] = count.get(name, -1) + 1
            moved = tick % self.setting.gait.period == 0 or self.row_kinds[name].moves == "tick"
            if name in before:
                rows[row] = before[name][min(place + moved, len(before[name]) - 1)]
        return rows

    def missed(self, qp: ParametricQp, theta: np.ndarray, decisions: np.ndarray | None) -> np.ndarray:
        """By how much a plan misses each of `PeriodicMpc.constraints`, shape (n_c,); what is not noticed is 0.

        Args:
            qp: the program of one phase.
            theta: its parameters.
            decisions: the first of its decisions, the slacks left out; None for no plan at all: then a constraint is
                missed by as much as its own bounds contradict each other.
        """
        _, low, high = qp.vectors(theta)
        if decisions is None:
            beyond = low - high
        else:
            value = qp.A[:, : len(decisions)] @ decisions
            beyond = np.maximum(low - value, value - high)
        missed_as = np.array([self.row_kinds[name].missed_as for name in qp.names])
        names = dict.fromkeys(kind.missed_as for kind in self.row_kinds.values() if kind.missed_as)
        amounts = np.array([beyond[missed_as == name].max(initial=0.0) for name in names])
        return np.where(amounts > NOTICED, amounts, 0.0)


def layout(sizes: dict[str, int]) -> dict[str, slice]:
    """Where each named part lies in one long vector."""
    stops = np.cumsum(list(sizes.values())).tolist()
    return {name: slice(stop - size, stop) for (name, size), stop in zip(sizes.items(), stops, strict=True)}
