"""The constraints that plans of a run did not meet, tick by tick, by name and in sentences, from the log alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis.barrier_margins import barriers_of, units_of
from pdhocbf_drake.mpc.plan import NOTICED, Reason
from pdhocbf_drake.mpc.terms import constraints_of
from pdhocbf_drake.simulation.run_folder import Run

_MOST = 5  # kinds of ticks that are listed one by one
_WORDS = {float(reason): reason.name for reason in Reason}


class GaveWay(NamedTuple):
    """The constraints that the plan in each row of a log does not meet.

    Attributes:
        ticks: the tick at which it was made, (T,); negative for the start, which nobody planned.
        reasons: its `mpc.solution.Reason`, (T,).
        names: of the constraints, "barrier NAME" or "step x" for example, (n,).
        units: of the amounts, (n,).
        amounts: by how much each is missed, (T, n).
        told: which of them are large enough to be reported, (T, n).
    """

    ticks: NDArray[np.int_]
    reasons: NDArray[np.float64]
    names: list[str]
    units: list[str]
    amounts: NDArray[np.float64]
    told: NDArray[np.bool_]

    def sentence(self, row: int) -> str:
        """A row as "tick 231: SOFTENED, barrier forward_speed by 0.012 m/s"."""
        return f"tick {self.ticks[row]}: {self.words(row)}"

    def words(self, row: int) -> str:
        """The same without its tick."""
        reason = self.reasons[row]
        missed = [
            f"{self.names[i]} by {self.amounts[row, i]:.2g} {self.units[i]}" for i in np.flatnonzero(self.told[row])
        ]
        return ", ".join([_WORDS.get(reason, f"reason {reason:g}"), *missed])


def gave_way(run: Run) -> GaveWay:
    """Reads the log; an older one, without the slack of each barrier, has the one name "a barrier"."""
    log, scenario = run.log, run.scenario
    reasons = log.element("solver_status", "reason")
    if "barrier_slack" in log:
        names = [f"barrier {name}" for name in barriers_of(scenario)]
        units = [use.unit for use in barriers_of(scenario).values()]
        amounts = log["barrier_slack"]
    else:
        names, units, amounts = ["a barrier"], [units_of([scenario])], log["solver_status"][:, 3:4]
    told = amounts > NOTICED
    # A hard barrier is softened where it can't be kept exactly, be it by less than is noticed.
    barely = (reasons == Reason.SOFTENED) & ~told.any(axis=1)
    told |= barely[:, None] & (amounts > 0.0) & (amounts == amounts.max(axis=1, initial=0.0)[:, None])
    if "unmet" in log:
        constraints = constraints_of(scenario.mpc)
        ends = {"stability": "terminal set"} if scenario.mpc.terminal_set is not None else {}
        names += [f"{ends.get(constraint, constraint)} {axis}" for axis in "xy" for constraint in constraints]
        units += [*constraints.values(), *constraints.values()]
        amounts = np.hstack([amounts, log["unmet"]])
        told = np.hstack([told, log["unmet"] > NOTICED])
    ticks = np.round(log.time / scenario.tick).astype(int) - 1
    return GaveWay(ticks, reasons, names, units, amounts, told)


def gave_way_rows(run: Run) -> list[tuple[str, str]]:
    """(first tick, its sentence) for each kind of degraded tick; a kind has one reason and one set of constraints."""
    if "solver_status" not in run.log:
        return []
    found = gave_way(run)
    kinds: dict[tuple[float, bytes], list[int]] = {}
    degraded = (found.reasons != Reason.SOLVED) | found.told.any(axis=1)
    for row in np.flatnonzero((found.ticks >= 0) & degraded).tolist():
        kinds.setdefault((found.reasons[row], found.told[row].tobytes()), []).append(row)
    rows = []
    for alike in list(kinds.values())[:_MOST]:
        more = f"; {len(alike) - 1} more like it" if len(alike) > 1 else ""
        rows.append((f"tick {found.ticks[alike[0]]}", f"{found.words(alike[0])}{more}"))
    if left := sum(map(len, list(kinds.values())[_MOST:])):
        rows.append(("later ticks", f"{left} of {len(kinds) - _MOST} other kinds, see the log"))
    return rows
