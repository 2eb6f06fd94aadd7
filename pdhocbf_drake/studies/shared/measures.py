"""What is measured of one unsafe event, on the template and on the robot alike."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.studies.push.variants import DCBF, NONE, PERIODIC

Array = NDArray[np.float64]
ACTS = 1e-3  # [m/s]: a ZMP velocity that differs by more from the one without a barrier is an action


class Measures(NamedTuple):
    """One event under one barrier; times are counted from the event, NaN where something never happens.

    Attributes:
        plant, barrier, gamma, event, phase: which experiment; gamma is NaN without a barrier, phase a tick.
        notices: until the barrier's own h < 0 on the measured state [s].
        acts: until the ZMP velocity differs by 1 mm/s more than it ever does in an undisturbed gait from what the same
            controller does without the barrier [s]: on the template from the same state, on the robot in the walk that
            met the same event.
        excess: largest velocity above the nominal orbit [m/s].
        recovers: until the velocity stays within the periodic margin of the orbit [s].
        steps: the same in steps, rounded up.
        work: positive mechanical work: of the horizontal force on the template [J/kg], of the joints on the robot [J].
        survived: whether the walk went on.
    """

    plant: str
    barrier: str
    gamma: float
    event: str
    phase: int
    notices: float
    acts: float
    excess: float
    recovers: float
    steps: float
    work: float
    survived: bool

    def as_json(self) -> dict[str, Any]:
        """Plain data, with null for NaN."""
        plain = self._asdict()
        return {key: None if isinstance(value, float) and math.isnan(value) else value for key, value in plain.items()}


def in_every_case(
    under: Callable[[str, float], list[Measures]], gammas: Sequence[float], tell: Callable[[str], None]
) -> list[Measures]:
    """The events without a barrier, then under both kinds of barrier for each γ; `tell` hears what comes next."""
    tell(NONE)
    rows = under(NONE, math.nan)
    for barrier in (DCBF, PERIODIC):
        for gamma in gammas:
            tell(f"{barrier}, gamma {gamma:g}")
            rows += under(barrier, gamma)
    return rows


def first_time(mask: NDArray[np.bool_], tick: float) -> float:
    """When a mask is true for the first time [s]; NaN where never."""
    return float(np.argmax(mask)) * tick if mask.any() else math.nan


def recovery_time(above: Array, margin: float, tick: float) -> float:
    """Until the velocity above the orbit stays below the margin [s]; NaN where it does not to the end."""
    late = np.flatnonzero(above > 1.01 * margin)
    if not len(late):
        return 0.0
    return math.nan if late[-1] + 1 >= len(above) else float(late[-1] + 1) * tick


def summarised(rows: Sequence[Measures]) -> list[tuple[str, ...]]:
    """One row per event, barrier and γ: medians over the phases; "–" where the median phase has none."""
    groups: dict[tuple[str, str, float], list[Measures]] = {}
    for row in rows:
        key = (row.event, row.barrier, -1.0 if math.isnan(row.gamma) else row.gamma)
        groups.setdefault(key, []).append(row)
    table = []
    for (event, barrier, gamma), group in groups.items():
        cells = [_median(group, name, scale) for name, scale in COLUMNS.values()]
        noticed = sum(not math.isnan(row.notices) for row in group)
        rate = "–" if gamma < 0 else f"{gamma:g}"
        seen = "–" if gamma < 0 else f"{noticed}/{len(group)}"
        table.append((event, barrier, rate, seen, *cells, f"{sum(row.survived for row in group)}/{len(group)}"))
    return table


COLUMNS = {
    "notices [ms]": ("notices", 1e3),
    "acts [ms]": ("acts", 1e3),
    "excess [mm/s]": ("excess", 1e3),
    "recovers [s]": ("recovers", 1.0),
    "steps": ("steps", 1.0),
    "work": ("work", 1.0),
}
HEADER = ("event", "barrier", "γ", "noticed", *COLUMNS, "walked on")


def _median(group: Sequence[Measures], name: str, scale: float) -> str:
    values = np.array([getattr(row, name) for row in group])
    # What never happens comes after everything that does.
    middle = float(np.median(np.where(np.isnan(values), np.inf, values)))
    return f"{middle * scale:.3g}" if math.isfinite(middle) else "–"
