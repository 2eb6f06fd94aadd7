"""A parametric quadratic program solved by DAQP, warm-started by a guessed active set."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.qp.affine_map import check_parameters
from pdhocbf_drake.qp.daqp_form import DaqpForm
from pdhocbf_drake.qp.daqp_library import is_usable
from pdhocbf_drake.qp.daqp_packed import PackedQp
from pdhocbf_drake.qp.kernels import solve_programs
from pdhocbf_drake.qp.parametric_qp import ParametricQp, QpResult

if TYPE_CHECKING:
    from pdhocbf_drake.qp.daqp_steps import DaqpSteps

_INFEASIBLE = -1
_MESSAGES = {
    -1: "infeasible",
    -2: "cycling",
    -3: "unbounded",
    -4: "iteration limit",
    -5: "not convex",
    -6: "overdetermined set",
}
_NO_GUESS = np.zeros(0)

Source = tuple[ParametricQp, Sequence[str], "np.ndarray | None"]
"""Arguments of `DaqpQp`."""

Arguments = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""θ, the guess (empty for none), and room for the decisions and for the flags of the rows."""


class DaqpQp:
    """Solves a `ParametricQp` at many θ in the coordinates of `DaqpForm`.

    A solve is one compiled call that calls DAQP. Where it can't (see `daqp_library`), `steps` does the same through
    `daqp.Model`, with the same answer to the last bit.

    Attributes:
        rows: the number of rows of A.
        packed: the program as that call needs it; None where a solve goes in steps.
        steps: the solve in steps.

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
        self._source: Callable[[], Source] = lambda: (qp, bound_rows, guess_rows)
        (self.rows, self._decisions), self._parameters = qp.A.shape, qp.linear.parameters
        form, guess_from = self._form
        self._guess_length = int(guess_from.max(initial=-1)) + 1
        self.packed = PackedQp.of_form(form, guess_from) if is_usable() else None
        flag = self.steps.flag if self.packed is None else self.packed.workspace.flag
        if flag < 0:
            raise InputError(f"the compiled program can't be set up in DAQP: {_message(flag)}")

    def constants(self) -> dict[str, np.ndarray] | None:
        """What `of_constants` makes an equal solver from; None where a solve goes in steps."""
        if self.packed is None:
            return None
        sizes = [self.rows, self._decisions, self._parameters, self._guess_length]
        return {"sizes": np.array(sizes, dtype=np.int64), **self.packed.constants()}

    @classmethod
    def of_constants(cls, kept: Mapping[str, np.ndarray], source: Callable[[], Source]) -> DaqpQp | None:
        """A solver from what `constants` gave, without its work; None where a solve goes in steps, or DAQP refuses it.

        Args:
            kept: the constants.
            source: gives the arguments that the first solver was made from, for a copy, or for its program.
        """
        if not is_usable():
            return None
        other = cls.__new__(cls)
        other._source = source
        other.rows, other._decisions, other._parameters, other._guess_length = kept["sizes"].tolist()
        other.packed = PackedQp.of_constants(kept)
        return other if other.packed.workspace.flag >= 0 else None

    def __reduce__(self) -> tuple[type[DaqpQp], Source]:
        """A copy is set up anew: DAQP's memory can't be copied."""
        return DaqpQp, self._source()

    @property
    def qp(self) -> ParametricQp:
        """The compiled program."""
        return self._source()[0]

    @cached_property
    def _form(self) -> tuple[DaqpForm, np.ndarray]:
        """The program in DAQP's coordinates, and for each of its rows the place of its flag in a guess."""
        qp, bound_rows, guess_rows = self._source()
        form = DaqpForm(qp, bound_rows)
        return form, form.order if guess_rows is None else guess_rows[form.order]

    @cached_property
    def steps(self) -> DaqpSteps:
        from pdhocbf_drake.qp.daqp_steps import DaqpSteps  # here, since daqp may not be installed

        return DaqpSteps(*self._form)

    @property
    def iterations(self) -> int:
        """Of the last solve."""
        return self.steps.iterations if self.packed is None else self.packed.workspace.iterations

    @property
    def core_seconds(self) -> float:
        """Of the last solve, by DAQP's own clock."""
        return self.steps.seconds if self.packed is None else self.packed.workspace.seconds

    def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult:
        """Solves at θ, from the active set of an earlier result (`QpResult.active`), which never changes the answer.

        Raises:
            InputError: θ has another length than the parameters, or the guess is too short for `guess_rows`.
        """
        given = self.arguments(theta, guess)
        if self.packed is None:
            return answer(given, *self.steps.solve(*given))
        own = (*self.packed.arrays, *given)
        _, _, flag, cost = solve_programs(1, *own, *own)
        return answer(given, flag, cost)

    def arguments(self, theta: np.ndarray, guess: np.ndarray | None) -> Arguments:
        """What one solve reads and writes, checked, since machine code would read and write beyond it."""
        check_parameters(theta, self._parameters)
        if guess is None:
            guess = _NO_GUESS
        elif len(guess) < self._guess_length:
            raise InputError(f"a guess must have {self._guess_length} entries at least, given {len(guess)}")
        return theta, guess, np.empty(self._decisions), np.empty(self.rows)


def solve_both(
    first: DaqpQp, second: DaqpQp, theta: Sequence[np.ndarray], guess: Sequence[np.ndarray | None]
) -> tuple[QpResult, QpResult]:
    """What `solve` of each gives, in one compiled call where that can be.

    Raises:
        InputError: as `DaqpQp.solve`.
    """
    if first.packed is None or second.packed is None:
        return first.solve(theta[0], guess[0]), second.solve(theta[1], guess[1])
    given, given_2 = first.arguments(theta[0], guess[0]), second.arguments(theta[1], guess[1])
    flag, cost, flag_2, cost_2 = solve_programs(2, *first.packed.arrays, *given, *second.packed.arrays, *given_2)
    return answer(given, flag, cost), answer(given_2, flag_2, cost_2)


def answer(given: Arguments, flag: int, cost: float) -> QpResult:
    """DAQP's flag and the cost with the arrays that a solve has written."""
    _, _, decisions, active = given
    ok = flag > 0
    return QpResult(ok, decisions, cost, active, flag == _INFEASIBLE, "optimal" if ok else _message(flag))


def _message(flag: int) -> str:
    return _MESSAGES.get(flag, f"exit {flag}")
