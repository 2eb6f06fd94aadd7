"""The unsafe events of Fig. 7 as tables, and sentences whose numbers and words follow from the outcomes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from pdhocbf_drake.studies.reproduce.calibration import PAPER_PERIODIC
from pdhocbf_drake.studies.reproduce.report import LABELS, Table
from pdhocbf_drake.studies.shared.cases import CASES, DCBF, NONE, PERIODIC
from pdhocbf_drake.studies.shared.measures import Array, Outcome

BARRIERS = (DCBF, PERIODIC)
Kicks = Mapping[float, Mapping[str, list[Outcome]]]
"""An outcome for each phase of a step, by size [m/s] and case."""
Events = Mapping[float, Mapping[str, Outcome]]
"""An outcome by size and case."""


def speed(outcome: Outcome) -> Array:
    """Forward CoM velocity from the event on, (T,) [m/s]."""
    return np.asarray(outcome.record.states[:, 0, 1])


def bound(outcome: Outcome) -> Array:
    """V̄ of the one upper bound on the forward velocity, v + h, (T,) [m/s]."""
    return np.asarray(speed(outcome) + outcome.record.h[:, 0])


def kick_table(by_size: Kicks) -> Table:
    """One row for each kick and case."""
    rows = []
    phases = max(len(cases[NONE]) for cases in by_size.values())
    for size, cases in by_size.items():
        free = np.array([o.recovers for o in cases[NONE]])
        for case, outcomes in cases.items():
            recovers = np.array([o.recovers for o in outcomes])
            row = {
                "kick [mm/s]": f"{1e3 * size:g}",
                "case": LABELS[case],
                f"phases with h < 0 at once (of {phases})": f"{count(o.notices == 0 for o in outcomes)}",
                "phases with action within a tick": f"{count(o.acts <= 1 for o in outcomes)}",
                "brakes by, mean [mm/s]": f"{1e3 * np.mean(braking(cases, case)):.1f}",
                "recovery, mean [ticks]": f"{recovers.mean():.1f}",
                "longest": f"{recovers.max():.0f}",
                "phases slower than without": f"{count(recovers > free)}",
            }
            common = ("kick [mm/s]", "case", "recovery, mean [ticks]", "longest")
            rows.append(row if case in BARRIERS else {key: row[key] if key in common else "–" for key in row})
    return Table(f"Velocity kicks at each of the {phases} phases", rows)


def push_table(pushes: Events, step: str) -> Table:
    """One row for each push and case; `step` is the duration of a push, in words."""
    caption = f"A sustained push, {step} from the start of a step on"
    return _event_table(caption, "push [m/s²]", "recovery [ticks]", lambda o: tick(o.recovers), pushes)


def command_table(orders: Events, right: float) -> Table:
    """One row for each command and case; `right` is the stride that the bounds were made for [m]."""
    caption = f"A wrong speed command, for the rest of the walk (right: {right:g} m)"
    above = "above the periodic bound [mm/s]"
    return _event_table(caption, "commanded stride [m]", above, lambda o: f"{_above_bound(o):.1f}", orders)


def _event_table(caption: str, event: str, last: str, cell: Callable[[Outcome], str], outcomes: Events) -> Table:
    """One row for each event and case; `last` and `cell` are the last column's header and its cell from an outcome."""
    rows = [
        {
            event: f"{size:g}",
            "case": LABELS[case],
            "h < 0 after [ticks]": tick(o.notices),
            "acts after [ticks]": tick(o.acts),
            "peak above nominal [mm/s]": f"{1e3 * o.excess:.1f}",
            last: cell(o),
        }
        for size, cases in outcomes.items()
        for case, o in cases.items()
    ]
    return Table(caption, rows)


def braking(cases: Mapping[str, list[Outcome]], case: str) -> list[float]:
    """By how much the velocity falls below that without a barrier within half a step, for each phase [m/s]."""
    half = max(1, len(cases[NONE]) // 2)  # an outcome for each tick of a step
    pairs = zip(cases[case], cases[NONE], strict=True)
    return [float((speed(free) - speed(outcome))[:half].max()) for outcome, free in pairs]


def tick(value: float) -> str:
    """A number of ticks for a table."""
    return "never" if np.isnan(value) else f"{value:.0f}"


def count(flags: Iterable[object]) -> int:
    """The number of true ones."""
    return sum(bool(flag) for flag in flags)


def finding(kicks: Kicks, pushes: Events, orders: Events) -> str:
    """Which barrier notices the kicks, which acts before its own h < 0, and the effect of a wrong command on each."""
    noticed, excess, total = _noticed(kicks), _excess(orders), _total(kicks)
    ahead = {case: count(acts_first(cases[case]) for cases in pushes.values()) for case in BARRIERS}
    return (
        f"The periodic barrier notices {noticed[PERIODIC]} of {total} kicks at once, the constant one "
        f"{noticed[DCBF]}. Of {len(pushes)} sustained pushes the periodic one acts before its bound is crossed in "
        f"{ahead[PERIODIC]}, the constant one in {ahead[DCBF]}. A wrong command takes the velocity "
        f"{excess[PERIODIC]:.1f} mm/s over the periodic bound under the periodic barrier, {excess[DCBF]:.1f} mm/s "
        "under the constant one."
    )


def conclusions(kicks: Kicks, orders: Events, nominal: np.ndarray) -> list[str]:
    """The paper's claims one by one; `nominal` is the settled velocity over a step, (N,) [m/s]."""
    noticed, excess, total = _noticed(kicks), _excess(orders), _total(kicks)
    constant = [outcome for cases in kicks.values() for outcome in cases[DCBF]]
    faint = {case: count(b < 1e-3 for cases in kicks.values() for b in braking(cases, case)) for case in BARRIERS}
    least = min(o.excess / size for size, cases in kicks.items() for o in cases[PERIODIC])
    large = kicks[max(kicks)]
    slower = count(c.recovers > f.recovers for c, f in zip(large[DCBF], large[NONE], strict=True))
    limit, peak = float(bound(large[PERIODIC][0])[: len(nominal)].mean()), float(nominal.max())
    recoveries = []
    for size, cases in kicks.items():
        mean = {case: np.mean([o.recovers for o in cases[case]]) for case in CASES}
        recoveries.append(
            f"{mean[PERIODIC]:.0f} ticks against {mean[DCBF]:.0f} (DCBF) and {mean[NONE]:.0f} (none) at "
            f"{1e3 * size:g} mm/s"
        )
    return [
        f"As an alarm: the periodic barrier notices {noticed[PERIODIC]} of these {total} kicks at once, the constant "
        f"one {noticed[DCBF]}, since a kick may stay under its bound. The walk comes back after "
        f"{', '.join(recoveries)}.",
        "“The DCBF is unable to react”: inside an MPC a barrier constrains the prediction, so it can act before its "
        f"bound is crossed. The constant one acts within a tick in {count(o.acts <= 1 for o in constant)} of {total} "
        f"kicks, and before its own h < 0 in {count(map(acts_first, constant))}. In {faint[DCBF]} of them it slows "
        f"the walk by less than 1 mm/s within half a step (periodic: {faint[PERIODIC]}).",
        "“Such a deviation would not occur under P-DHOCBF”: no barrier undoes a kick, which is there before any "
        f"input can work. Under the periodic barrier too each takes the velocity at least {least:.2f} of its size "
        "above nominal.",
        f"After kicks of {1e3 * max(kicks):g} mm/s the constant barrier recovers more slowly than no barrier at "
        f"{slower} of {len(large[NONE])} phases"
        + (": it can brake hard and then let the velocity lie above nominal, under its bound." if slower else "."),
        f"All this compares a tight bound with a loose one. The periodic bound's mean is {limit:.3f} m/s, "
        f"{'below' if limit < peak else 'not below'} the walk's own peak of {peak:.3f} m/s: a constant bound "
        f"{'cannot' if limit < peak else 'could'} be that tight.",
        "When the plan itself would break the bound, under a wrong speed command: the periodic barrier lets the "
        f"velocity exceed the periodic bound by {excess[PERIODIC]:.1g} mm/s at most, the constant one by "
        f"{excess[DCBF]:.1f} mm/s and no barrier by {excess[NONE]:.0f} mm/s.",
    ]


def acts_first(outcome: Outcome) -> bool:
    """Whether the barrier acts, and does so before its own h < 0 (which may never come)."""
    return not np.isnan(outcome.acts) and not outcome.acts >= outcome.notices


def _noticed(kicks: Kicks) -> dict[str, int]:
    """How many kicks each barrier notices at once."""
    return {case: count(o.notices == 0 for cases in kicks.values() for o in cases[case]) for case in BARRIERS}


def _total(kicks: Kicks) -> int:
    return sum(len(cases[NONE]) for cases in kicks.values())


def _above_bound(outcome: Outcome) -> float:
    """The most by which the velocity exceeds the periodic bound [mm/s]."""
    return 1e3 * max(0.0, outcome.excess - PAPER_PERIODIC)


def _excess(orders: Events) -> dict[str, float]:
    """The most by which the velocity exceeds the periodic bound under any command, by case [mm/s]."""
    return {case: max(_above_bound(cases[case]) for cases in orders.values()) for case in CASES}
