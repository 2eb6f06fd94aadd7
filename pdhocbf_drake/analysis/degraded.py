"""The constraints that the plans of a run missed at each tick, and the degraded ticks in a few lines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis.barrier_margins import barriers_of, units_of
from pdhocbf_drake.estimation.sample import Notice
from pdhocbf_drake.mpc.plan import NOTICED, Reason
from pdhocbf_drake.mpc.terms import constraints_of
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.whole_body.reason import Reason as WholeBodyReason

_MOST = 5  # kinds of degraded ticks that are listed one by one
_WORDS = {float(reason): reason.name for reason in Reason}


class Misses(NamedTuple):
    """The constraints that the plan in each row of a log does not meet.

    Attributes:
        ticks: the tick of the plan, (T,); negative for the start, which has none.
        reasons: its `mpc.plan.Reason`, (T,).
        names, units: of the n constraints, "barrier NAME" or "step x" for example, and of their amounts.
        amounts: by how much each constraint is missed, (T, n) [its unit].
        reported: whether the amount is large enough to be reported, (T, n).
    """

    ticks: NDArray[np.int_]
    reasons: NDArray[np.float64]
    names: list[str]
    units: list[str]
    amounts: NDArray[np.float64]
    reported: NDArray[np.bool_]

    def words(self, row: int) -> str:
        """The row's reason and misses, as "SOFTENED, barrier forward_speed by 0.012 m/s"."""
        missed = np.flatnonzero(self.reported[row])
        reason = _WORDS.get(self.reasons[row], f"reason {self.reasons[row]:g}")
        return ", ".join([reason, *(f"{self.names[i]} by {self.amounts[row, i]:.2g} {self.units[i]}" for i in missed)])


def misses(run: Run) -> Misses:
    """Reads the log; in an older one, without the slack of each barrier, the only barrier is "a barrier"."""
    log, scenario = run.log, run.scenario
    reasons = log.element("solver_status", "reason")
    if "barrier_slack" in log:
        names = [f"barrier {name}" for name in barriers_of(scenario)]
        units = [use.unit for use in barriers_of(scenario).values()]
        amounts = log["barrier_slack"]
    else:
        names, units, amounts = ["a barrier"], [units_of([scenario])], log["solver_status"][:, 3:4]
    reported = amounts > NOTICED
    # Of a softened tick the largest slack is reported, even if it is smaller.
    barely = (reasons == Reason.SOFTENED) & ~reported.any(axis=1)
    reported |= barely[:, None] & (amounts > 0.0) & (amounts == amounts.max(axis=1, initial=0.0)[:, None])
    if "unmet" in log:
        constraints = constraints_of(scenario.mpc)
        ends = {"stability": "terminal set"} if scenario.mpc.terminal_set is not None else {}
        names += [f"{ends.get(constraint, constraint)} {axis}" for axis in "xy" for constraint in constraints]
        units += [*constraints.values()] * 2
        amounts = np.hstack([amounts, log["unmet"]])
        reported = np.hstack([reported, log["unmet"] > NOTICED])
    ticks = np.round(log.time / scenario.tick).astype(int) - 1
    return Misses(ticks, reasons, names, units, amounts, reported)


def degraded_rows(run: Run) -> list[tuple[str, str]]:
    """(first tick, what was missed) of each kind of degraded tick: one reason, one set of missed constraints.

    Then the same of what the estimator found wrong with its sensors, and of the limits of joints and soles.
    """
    if "solver_status" not in run.log:
        return []
    return [*_degraded_plans(run), *_sensor_rows(run), *_whole_body_rows(run)]


def _whole_body_rows(run: Run) -> list[tuple[str, str]]:
    """(first tick, what was done) of each reason of the whole-body program, with its largest miss."""
    if "whole_body" not in run.log:
        return []
    rows, (reasons, amounts) = [], run.log["whole_body"][:, :2].T
    for reason in dict.fromkeys(reasons[reasons != WholeBodyReason.INSIDE].tolist()):
        alike = np.flatnonzero(reasons == reason)
        more = f"; {len(alike) - 1} more like it" if len(alike) > 1 else ""
        most = amounts[alike].max()
        by = f" by up to {100.0 * most:.2g} % of the limit" if most > 0.0 else ""
        rows.append((f"limits, tick {alike[0]}", f"{WholeBodyReason(int(reason)).name}{by}{more}"))
    return rows[:_MOST]


def _sensor_rows(run: Run) -> list[tuple[str, str]]:
    """(first tick, what was found wrong) of each set of notices of the estimator."""
    if "estimator_status" not in run.log:
        return []
    notices = run.log.element("estimator_status", "notice").astype(int)
    rows = []
    for value in dict.fromkeys(notices[notices != 0].tolist()):
        alike = np.flatnonzero(notices == value)
        more = f"; {len(alike) - 1} more like it" if len(alike) > 1 else ""
        names = ", ".join(str(notice.name) for notice in Notice if notice & value)
        rows.append((f"sensors, tick {alike[0]}", f"{names}{more}"))
    return rows[:_MOST]


def _degraded_plans(run: Run) -> list[tuple[str, str]]:
    found = misses(run)
    kinds: dict[tuple[float, bytes], list[int]] = {}
    degraded = (found.reasons != Reason.SOLVED) | found.reported.any(axis=1)
    for row in np.flatnonzero((found.ticks >= 0) & degraded).tolist():
        kinds.setdefault((found.reasons[row], found.reported[row].tobytes()), []).append(row)
    listed, others = list(kinds.values())[:_MOST], list(kinds.values())[_MOST:]
    rows = []
    for alike in listed:
        more = f"; {len(alike) - 1} more like it" if len(alike) > 1 else ""
        rows.append((f"tick {found.ticks[alike[0]]}", f"{found.words(alike[0])}{more}"))
    if others:
        rows.append(("later ticks", f"{sum(map(len, others))} of {len(others)} other kinds, see the log"))
    return rows
