"""A program solved by `daqp.Model` step by step: where kernels can't call DAQP, and what they must agree with."""

from __future__ import annotations

import daqp
import numpy as np

from pdhocbf_drake.qp.daqp_form import DaqpForm
from pdhocbf_drake.qp.daqp_library import SETTINGS
from pdhocbf_drake.qp.kernels import (
    DEPENDENT,
    OPTIMAL_SOFTENED,
    is_finite,
    write_decisions,
    write_limits,
    write_senses,
    write_slacks,
)

Outcome = tuple[int, np.ndarray, np.ndarray]
"""DAQP's exit flag, y and the multipliers; see `DaqpForm`."""


class DaqpSteps:
    """The steps `prepare`, `start_from`, `factorize`, `iterate` and `finish` of a solve, each of which can be timed.

    Attributes:
        flag: of DAQP's set-up, negative where it refuses the program.
        seconds, iterations: of DAQP's last solve, the seconds by its own clock.

    Args:
        form: the program.
        guess_from: for each row of the form the place of its flag in a guess, (m,).
    """

    def __init__(self, form: DaqpForm, guess_from: np.ndarray) -> None:
        self._form, self._guess_from = form, guess_from
        self.seconds, self.iterations = 0.0, 0
        n = len(form.hard)
        self._optimum, self._product, self._beyond = np.zeros(n), np.zeros(n), np.zeros(len(form.rows))
        self._limits = form.bounds.offset.copy()
        self._low, self._high = np.split(self._limits, 2)
        self._guessed = form.senses.copy()
        self._model = daqp.Model()
        self._model.settings = SETTINGS
        wide = form.wide_limits
        self.flag, _ = self._model.setup(form.hessian, None, np.ascontiguousarray(form.rows), wide, -wide, form.senses)
        if self.flag >= 0 and len(form.softened):
            rho, linear = form.soft_weights
            self._model.soft_weights(rho_l=rho, rho_u=rho, w_l=linear, w_u=linear)

    def solve(
        self, theta: np.ndarray, guess: np.ndarray, decisions: np.ndarray, active: np.ndarray
    ) -> tuple[int, float]:
        """All of them: what `kernels.solve_packed` does, with its arguments."""
        least = self.prepare(theta)
        decisions[:] = active[:] = 0.0
        outcome = self._from(guess)
        if outcome[0] < 0 and len(guess):
            outcome = self._from(guess[:0])
        return outcome[0], self.finish(least, outcome, decisions, active)

    def _from(self, guess: np.ndarray) -> Outcome:
        self.start_from(guess)
        flag = self.factorize()
        return self.iterate() if flag >= 0 else (flag, self._optimum, self._low)

    def prepare(self, theta: np.ndarray) -> float:
        """Computes z° and the limits on R y at θ; returns the cost at z°."""
        return write_limits(*self._form.to_limits, theta, self._optimum, self._beyond, self._limits)

    def start_from(self, guess: np.ndarray) -> None:
        """Takes the guessed active set as the one to start from; an empty one stands for the equalities alone."""
        self._start = self._form.senses
        if len(guess):
            write_senses(guess, self._guess_from, self._form.senses, self._guessed)
            self._start = self._guessed

    def factorize(self) -> int:
        """Hands the limits and the active set to DAQP, which factorizes it; returns its exit flag."""
        return int(self._model.update(bupper=self._high, blower=self._low, sense=self._start))

    def iterate(self) -> Outcome:
        """Runs DAQP from the active set that it has factorized."""
        y, _, flag, info = self._model.solve()
        self.seconds, self.iterations = info["solve_time"], info["iterations"]
        if flag > 0 and not is_finite(y):  # which DAQP calls optimal: the guess held rows that depend on each other
            return DEPENDENT, y, info["lam"]
        return flag, y, info["lam"]

    def finish(self, least: float, outcome: Outcome, decisions: np.ndarray, active: np.ndarray) -> float:
        """Writes w and the flags of the rows of A where there is an optimum; returns the cost, from that at z°."""
        flag, y, multipliers = outcome
        cost = least
        if flag > 0:
            cost += write_decisions(
                *self._form.to_decisions, self._optimum, y, multipliers, decisions, active, self._product
            )
        if flag == OPTIMAL_SOFTENED:
            cost += write_slacks(*self._form.to_slacks, y, self._beyond, self._limits, decisions)
        return cost
