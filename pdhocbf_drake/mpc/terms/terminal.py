"""The rows of a terminal set, eq. (20f)."""

from __future__ import annotations

from collections.abc import Hashable
from copy import copy
from typing import ClassVar

import numpy as np

from pdhocbf_drake.mpc.terminal_set import TerminalSet
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.term import RowKind, Setting, Term, Tick

RELAXED = 1e3
"""What a terminal row is relaxed by where it is not in force [m]: far more than any state of a walk."""


class TerminalRows(Term):
    """com·(c − f) + velocity·v + step·s + following·v⁺ ≤ bound + relaxed at the end of a plan, see `TerminalSet`.

    The rows of every step in the set's period are written, and those of the steps in which the plan does not end are
    relaxed, as all are while the walk does not repeat over the horizon. A set that withstands a disturbance has rows on
    the state two ticks on as well.

    Parameters: terminal, what each step's rows are relaxed by, (period / N,) [m].
    """

    rows: ClassVar = {
        "terminal set": RowKind("tick", missed_as="stability"),
        "invariant set": RowKind("tick", missed_as="stability"),
    }
    axes_alike = True

    def __init__(self, setting: Setting, terminal: TerminalSet) -> None:
        super().__init__(setting)
        self.terminal, self._written = terminal, True
        self._count = terminal.period // setting.gait.period

    @classmethod
    def of(cls, setting: Setting) -> list[Term]:
        return [] if setting.terminal is None else [cls(setting, setting.terminal)]

    @property
    def sizes(self) -> dict[str, int]:
        return {"terminal": self._count}

    @property
    def key(self) -> Hashable:
        terminal = self.terminal
        parts = (*terminal.rows, *terminal.bounds, *terminal.first, *terminal.first_bounds)
        sets = tuple(part.tobytes() for part in parts)
        return super().key, self._written, self.terminal.early, sets

    def write(self, program: AxisProgram) -> None:
        for step in range(self._count if self._written else 0):
            self._write_step(program, step)
            if self.terminal.first:
                self._write_first(program, step)

    def _write_first(self, program: AxisProgram, step: int) -> None:
        """The rows on the state as soon as the ZMP that is chosen now acts on it, in the given step of the period."""
        n, early = self.setting.gait.period, self.terminal.early
        ahead = 2 - early
        phase = (step * n + program.phase + ahead) % self.terminal.period
        rows, bounds = self.terminal.first[phase], self.terminal.first_bounds[phase]
        com, velocity, last, following, coming = rows.T[:, :, None]
        on_inputs, on_state = (
            com * m[ahead, 0] + velocity * m[ahead, 1] + following * m[ahead + 1, 1]
            for m in (program.gamma, program.phi)
        )
        stance = 1 + (program.phase + ahead) // n
        feet = np.hstack([-last, last - com - coming, coming])
        relaxed = program.part["terminal"][step : step + 1]
        variables = [program.u, program.part["state"], program.feet[stance - 1 : stance + 2], relaxed]
        lhs = np.hstack([-on_inputs, -on_state, -feet, np.ones((len(rows), 1))])
        program.at_least(lhs, np.concatenate(variables), "invariant set", -bounds)

    def _write_step(self, program: AxisProgram, step: int) -> None:
        """The rows for plans that end in the given step of the set's period."""
        early, phase = self.terminal.early, program.phase
        rows, bounds = self.terminal.at_end_of(step * self.setting.gait.period + phase)
        com, velocity, length, following = rows.T[:, :, None]
        at, last = 1 - early, (program.gamma[-2:], program.phi[-2:])
        on_inputs, on_state = (com * m[at, 0] + velocity * m[at, 1] + following * m[1, 1] for m in last)
        # One tick before a step begins, the CoM is still counted from the foot before.
        stands_on = [1.0, 0.0] if phase < early else [0.0, 1.0]
        lhs = np.hstack([on_inputs, on_state, length * [-1.0, 1.0] - com * stands_on])
        relaxed = program.part["terminal"][step : step + 1]
        variables = np.concatenate([program.u, program.part["state"], program.feet[-2:], relaxed])
        program.at_least(np.hstack([-lhs, np.ones((len(rows), 1))]), variables, "terminal set", -bounds)

    def fill_tick(self, tick: Tick, theta: np.ndarray) -> None:
        # Where the plan ends: H is a multiple of two steps, so at a step of the same parity.
        count = self._count
        in_force = (np.arange(count) == tick.step % count) & tick.ahead.repeats
        theta[self.places["terminal"]] = np.where(in_force, 0.0, RELAXED)

    def relaxed(self) -> Term:
        other = copy(self)
        other._written = False
        return other
