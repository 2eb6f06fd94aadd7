"""A parametric quadratic program in a persistent DAQP workspace, warm-started by a guessed active set."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp.affine_map import check_parameters
from pdhocbf_drake.qp.daqp_form import DaqpForm
from pdhocbf_drake.qp.kernels import EQUALITY, is_finite, write_decisions, write_limits, write_senses
from pdhocbf_drake.qp.parametric_qp import ParametricQp, QpResult

try:
    import daqp
except ImportError:
    daqp = None

_SETTINGS = {"primal_tol": 1e-10, "dual_tol": 1e-10, "iter_limit": 2000}
_INFEASIBLE, _SOFTENED, _DEPENDENT = -1, 2, -6
_MESSAGES = {
    -1: "infeasible",
    -2: "cycling",
    -3: "unbounded",
    -4: "iteration limit",
    -5: "not convex",
    -6: "overdetermined set",
}

Outcome = tuple[int, np.ndarray, np.ndarray]
"""DAQP's exit flag, y and the multipliers; see `DaqpForm`."""


def has_daqp() -> bool:
    """Whether the package `daqp` is installed."""
    return daqp is not None


class DaqpQp:
    """Solves a `ParametricQp` at many θ in the coordinates of `DaqpForm`.

    `solve` calls `prepare`, `start_from`, `factorize`, `iterate` and `result`, public so that each can be timed.

    Attributes:
        core_seconds, iterations: of DAQP's last solve, the seconds by its own clock.

    Raises:
        InputError: as `DaqpForm`, or DAQP refuses the program.
    """

    def __init__(self, qp: ParametricQp, bound_rows: Sequence[str] = (), guess_rows: np.ndarray | None = None) -> None:
        """
        Args:
            qp: the compiled program.
            bound_rows: names of rows of A that become simple bounds, as many as there are decisions besides slacks.
            guess_rows: for each row of A, the index in `guess` of its guessed activity (None: its own index). Serves
                where consecutive solves are of different programs whose rows correspond, as over a moving horizon.
        """
        self.qp, self.core_seconds, self.iterations = qp, 0.0, 0
        self._form = form = DaqpForm(qp, bound_rows)
        self._guess_from = form.order if guess_rows is None else guess_rows[form.order]
        self._guess_length = int(self._guess_from.max(initial=-1)) + 1
        self._to_limits, self._to_decisions = form.to_limits, form.to_decisions
        (self._rows, self._decisions), self._parameters = qp.A.shape, qp.linear.parameters
        n = len(form.hard)
        self._optimum, self._product, self._limits = np.zeros(n), np.zeros(n), form.bounds.offset.copy()
        self._low, self._high = np.split(self._limits, 2)
        self._senses, self._guessed = form.senses, form.senses.copy()
        self._softened_rows = np.vstack([np.eye(len(form.order) - len(form.rows), n), form.rows])[form.softened]
        self._model = self._set_up()

    def _set_up(self) -> daqp.Model:
        form, slacks = self._form, self._form.slacks
        model = daqp.Model()
        model.settings = _SETTINGS
        # The bounds at one θ may contradict each other, so set up with bounds that don't.
        wide = np.where(form.senses == EQUALITY, 0.0, 1e30)
        flag, _ = model.setup(form.hessian, None, np.ascontiguousarray(form.rows), wide, -wide, form.senses)
        if flag < 0:
            raise InputError(f"the compiled program can't be set up in DAQP: {_message(flag)}")
        if len(form.softened):
            rho, linear = np.zeros(len(form.order)), np.zeros(len(form.order))
            rho[form.softened], linear[form.softened] = 1.0 / slacks.quadratic, slacks.linear
            model.soft_weights(rho_l=rho, rho_u=rho, w_l=linear, w_u=linear)
        return model

    def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult:
        """Solves at θ, from the active set of an earlier result (`QpResult.active`), which never changes the answer.

        Raises:
            InputError: θ has another length than the parameters, or the guess is too short for `guess_rows`.
        """
        check_parameters(theta, self._parameters)
        least = self.prepare(theta)
        self.start_from(guess)
        outcome = self.iterate() if (flag := self.factorize()) >= 0 else self._failure(flag)
        if outcome[0] < 0 and guess is not None:
            return self.solve(theta)
        return self.result(least, outcome)

    def prepare(self, theta: np.ndarray) -> float:
        """Computes z° and the limits on R y at θ; returns the cost at z°."""
        return write_limits(*self._to_limits, theta, self._optimum, self._limits)

    def start_from(self, guess: np.ndarray | None) -> None:
        """Takes the guessed active set as the one to start from; None: equalities alone."""
        if guess is None:
            self._start = self._senses
            return
        if len(guess) < self._guess_length:  # beyond which machine code would read
            raise InputError(f"a guess must have {self._guess_length} entries at least, given {len(guess)}")
        write_senses(guess, self._guess_from, self._senses, self._guessed)
        self._start = self._guessed

    def factorize(self) -> int:
        """Hands the limits and the active set to DAQP, which factorizes it; returns its exit flag."""
        return self._model.update(bupper=self._high, blower=self._low, sense=self._start)

    def iterate(self) -> Outcome:
        """Runs DAQP from the active set that it has factorized."""
        y, _, flag, info = self._model.solve()
        self.core_seconds, self.iterations = info["solve_time"], info["iterations"]
        if flag > 0 and not is_finite(y):  # which DAQP calls optimal: the guess held rows that depend on each other
            return self._failure(_DEPENDENT)
        return flag, y, info["lam"]

    def _failure(self, flag: int) -> Outcome:
        return flag, np.zeros(len(self._optimum)), np.zeros(len(self._senses))

    def result(self, least: float, outcome: Outcome) -> QpResult:
        """The answer in w and the rows of A, from the cost at z° and DAQP's outcome."""
        flag, y, multipliers = outcome
        decisions, active = np.zeros(self._decisions), np.zeros(self._rows)
        cost = least + write_decisions(
            *self._to_decisions, self._optimum, y, multipliers, decisions, active, self._product
        )
        if flag == _SOFTENED:
            slacks, softened, values = self._form.slacks, self._form.softened, self._softened_rows @ y
            slack = np.maximum(0.0, np.maximum(self._low[softened] - values, values - self._high[softened]))
            decisions[slacks.columns] = slack
            cost += float(slack @ (slacks.linear + 0.5 * slacks.quadratic * slack))
        status = "optimal" if flag > 0 else _message(flag)
        return QpResult(flag > 0, decisions, cost, active, flag == _INFEASIBLE, status)


def _message(flag: int) -> str:
    return _MESSAGES.get(flag, f"exit {flag}")
