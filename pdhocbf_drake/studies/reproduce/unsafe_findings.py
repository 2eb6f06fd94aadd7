"""What the unsafe events of Fig. 7 say of the paper's claims: sentences whose numbers and words the outcomes choose."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pdhocbf_drake.studies.reproduce.calibration import PAPER_PERIODIC
from pdhocbf_drake.studies.reproduce.events import CASES, Outcome
from pdhocbf_drake.studies.reproduce.unsafe_tables import BARRIERS, braking, count

Kicks = Mapping[float, Mapping[str, list[Outcome]]]
"""By size [m/s] and case, an outcome for each phase of a step."""
Events = Mapping[float, Mapping[str, Outcome]]
"""By size and case."""


def finding(kicks: Kicks, pushes: Events, orders: Events) -> str:
    """Who sees the kicks, who acts before its own h < 0, and what a wrong command is allowed."""
    seen, excess = _seen(kicks), _excess(orders)
    ahead = {case: count(acts_first(cases[case]) for cases in pushes.values()) for case in BARRIERS}
    return (
        f"The periodic barrier sees {seen['periodic']} of {_total(kicks)} kicks at once, the constant one "
        f"{seen['constant']}. Of {len(pushes)} sustained pushes the periodic one acts before its bound is crossed in "
        f"{ahead['periodic']}, the constant one in {ahead['constant']}. A wrong command takes the velocity "
        f"{excess['periodic']:.1f} mm/s over the periodic bound under the periodic barrier, "
        f"{excess['constant']:.1f} mm/s under the constant one."
    )


def conclusions(kicks: Kicks, orders: Events, nominal: np.ndarray) -> list[str]:
    """The paper's claims one by one; `nominal` is the settled walk's velocity over a step (N,) [m/s]."""
    seen, excess, total = _seen(kicks), _excess(orders), _total(kicks)
    constant = [outcome for cases in kicks.values() for outcome in cases["constant"]]
    faint = {case: count(b < 1e-3 for cases in kicks.values() for b in braking(cases, case)) for case in BARRIERS}
    mean = {case: [np.mean([o.recovers for o in cases[case]]) for cases in kicks.values()] for case in CASES}
    large = kicks[max(kicks)]
    slower = count(c.recovers > f.recovers for c, f in zip(large["constant"], large["free"], strict=True))
    bound, peak = float(large["periodic"][0].bound[: len(nominal)].mean()), float(nominal.max())
    return [
        f"As an alarm: the periodic barrier sees {seen['periodic']} of these {total} kicks at once, the constant one "
        f"{seen['constant']}, since a kick may stay under its bound. The walk comes back after "
        + ", ".join(
            f"{mean['periodic'][i]:.0f} ticks against {mean['constant'][i]:.0f} (DCBF) and {mean['free'][i]:.0f} "
            f"(none) at {1e3 * size:g} mm/s"
            for i, size in enumerate(kicks)
        )
        + ".",
        "“The DCBF is unable to react”: inside an MPC a barrier constrains the prediction, so it can act before its "
        f"bound is crossed. The constant one acts within a tick in {count(o.acts <= 1 for o in constant)} of {total} "
        f"kicks, and before its own h < 0 in {count(map(acts_first, constant))}. In {faint['constant']} of them it "
        f"slows the walk by less than 1 mm/s within half a step (periodic: {faint['periodic']}).",
        "“Such a deviation would not occur under P-DHOCBF”: no barrier undoes a kick, which is there before any input "
        f"can work. Under the periodic barrier too each takes the velocity at least {_least_excess(kicks):.2f} of its "
        "size above nominal.",
        f"After kicks of {1e3 * max(kicks):g} mm/s the constant barrier recovers more slowly than no barrier at "
        f"{slower} of {len(large['free'])} phases"
        + (": it can brake hard and then let the velocity lie above nominal, under its bound." if slower else "."),
        f"All this compares a tight bound with a loose one. The periodic bound's mean is {bound:.3f} m/s, "
        f"{'below' if bound < peak else 'not below'} the walk's own peak of {peak:.3f} m/s: a constant bound "
        f"{'cannot' if bound < peak else 'could'} be that tight.",
        "When the plan itself would break the bound, under a wrong speed command: the periodic barrier lets the "
        f"velocity exceed the periodic bound by {excess['periodic']:.1g} mm/s at most, the constant one by "
        f"{excess['constant']:.1f} mm/s and no barrier by {excess['free']:.0f} mm/s.",
    ]


def acts_first(outcome: Outcome) -> bool:
    """Whether the barrier acts, and does so before its own h < 0 (which may never come)."""
    return outcome.acts == outcome.acts and not outcome.acts >= outcome.notices


def _seen(kicks: Kicks) -> dict[str, int]:
    return {case: count(o.notices == 0 for cases in kicks.values() for o in cases[case]) for case in BARRIERS}


def _total(kicks: Kicks) -> int:
    return sum(len(cases["free"]) for cases in kicks.values())


def _least_excess(kicks: Kicks) -> float:
    return float(min(o.peak / size for size, cases in kicks.items() for o in cases["periodic"]))


def _excess(orders: Events) -> dict[str, float]:
    """The most that any command takes the velocity over the periodic bound [mm/s]."""
    return {c: 1e3 * max(0.0, *(cases[c].peak - PAPER_PERIODIC for cases in orders.values())) for c in CASES}
