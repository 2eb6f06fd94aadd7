"""The unsafe events of Fig. 7 as tables: what was noticed, when something was done, and what that changed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from pdhocbf_drake.studies.reproduce import look
from pdhocbf_drake.studies.reproduce.calibration import PAPER_PERIODIC
from pdhocbf_drake.studies.reproduce.events import Outcome
from pdhocbf_drake.studies.reproduce.record import Table

BARRIERS = ("constant", "periodic")


def kick_table(by_size: Mapping[float, Mapping[str, list[Outcome]]]) -> Table:
    """One row a kick and case."""
    rows = []
    phases = max(len(cases["free"]) for cases in by_size.values())
    for size, cases in by_size.items():
        free = np.array([o.recovers for o in cases["free"]])
        for case, outcomes in cases.items():
            recovers = np.array([o.recovers for o in outcomes])
            barrier = case in BARRIERS
            rows.append(
                (
                    f"{1e3 * size:g}",
                    look.CASE_NAMES[case],
                    f"{count(o.notices == 0 for o in outcomes)}" if barrier else "–",
                    f"{count(o.acts <= 1 for o in outcomes)}" if barrier else "–",
                    f"{1e3 * np.mean(braking(cases, case)):.1f}" if barrier else "–",
                    f"{recovers.mean():.1f}",
                    f"{recovers.max():.0f}",
                    f"{count(recovers > free)}" if barrier else "–",
                )
            )
    header = (
        "kick [mm/s]",
        "case",
        f"phases with h < 0 at once (of {phases})",
        "phases with action within a tick",
        "brakes by, mean [mm/s]",
        "recovery, mean [ticks]",
        "longest",
        "phases slower than without",
    )
    return Table(f"Velocity kicks at each of the {phases} phases", header, rows)


def push_table(pushes: Mapping[float, Mapping[str, Outcome]], step: str) -> Table:
    """One row a push and case; `step` tells how long a push lasts."""
    last = ("recovery [ticks]", lambda o: f"{o.recovers:.0f}")
    return _event_table(f"A sustained push, {step} from the start of a step on", "push [m/s²]", last, pushes)


def command_table(orders: Mapping[float, Mapping[str, Outcome]], right: float) -> Table:
    """One row a command and case; `right` is the stride that the bounds were made for [m]."""
    last = ("above the periodic bound [mm/s]", lambda o: f"{1e3 * max(0.0, o.peak - PAPER_PERIODIC):.1f}")
    caption = f"A wrong speed command, for the rest of the walk (right: {right:g} m)"
    return _event_table(caption, "commanded stride [m]", last, orders)


def _event_table(
    caption: str, event: str, last: tuple[str, Callable[[Outcome], str]],
    outcomes: Mapping[float, Mapping[str, Outcome]],
) -> Table:  # fmt: skip
    """One row an event and case; the last column has a name and what it says of an outcome."""
    header = (event, "case", "h < 0 after [ticks]", "acts after [ticks]", "peak above nominal [mm/s]", last[0])
    rows = [
        (f"{size:g}", look.CASE_NAMES[case], tick(o.notices), tick(o.acts), f"{1e3 * o.peak:.1f}", last[1](o))
        for size, cases in outcomes.items()
        for case, o in cases.items()
    ]
    return Table(caption, header, rows)


def braking(cases: Mapping[str, list[Outcome]], case: str) -> list[float]:
    """Per phase: by how much the velocity falls below that without a barrier, within half a step [m/s]."""
    half = max(1, len(cases["free"]) // 2)  # an outcome for each tick of a step
    return [
        float((free.record.speed - outcome.record.speed)[:half].max())
        for outcome, free in zip(cases[case], cases["free"], strict=True)
    ]


def tick(value: float) -> str:
    """A number of ticks for a table."""
    return "never" if np.isnan(value) else f"{value:.0f}"


def count(flags: Iterable[object]) -> int:
    """How many are true."""
    return sum(bool(flag) for flag in flags)
