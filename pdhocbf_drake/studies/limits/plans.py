"""Pushes that a plan of the template survives which foresees them: what torques alone leave to a plan."""

from __future__ import annotations

import tempfile
from typing import Final

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.simulation.limits import checked_walk
from pdhocbf_drake.studies.limits.foreseen import HELD_ROLES, survived
from pdhocbf_drake.studies.limits.pushes import Pushed, least_impulse, phases_of, pushed
from pdhocbf_drake.studies.shared.checks import Outcome, least, most
from pdhocbf_drake.studies.shared.row_kinds import Asked

ROWS: Final[dict[str, str | None]] = {
    "foreseen pushes": None,
    **{f"foreseen pushes, {role} torque 80 %": role for role in HELD_ROLES},
}
"""The role that is weak, by the name of the row."""

_WAYS = {"+x": ("ahead", 1.0), "-x": ("back", -1.0)}


def plan(row: str, asked: Asked) -> list[Pushed]:
    """A piece for each direction."""
    return [Pushed(row, asked.scenario, asked.prepared, direction) for direction in _WAYS]


def measure(work: Pushed) -> Outcome:
    """The largest foreseen impulse at each tick."""
    role, (name, way) = ROWS[work.row], _WAYS[work.direction]
    with tempfile.TemporaryDirectory() as folder:
        scenario = pushed(work, role, folder)
        try:
            biped, kept = checked_walk(scenario)
        except ModelError as error:
            return Outcome([most(work.row, "refused", 1.0, 0.0)], [f"{work.row}: {error}"])
        phases = phases_of(scenario)
        found = survived(kept.scenario, biped, way, phases)
    what, wanted = f"median of what a plan survives {name}", least_impulse(name, biped.mass, role)
    return Outcome(
        [least(work.row, what, impulse, wanted, "N s")._replace(combine="median") for impulse in found],
        [f"{work.row}, {work.direction}: {[round(impulse, 1) for impulse in found]} N s at ticks {list(phases)}"],
    )
