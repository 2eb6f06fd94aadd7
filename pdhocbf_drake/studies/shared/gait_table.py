"""Measured gaits as a table, and the quantities that are its columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from pdhocbf_drake import terminal
from pdhocbf_drake.studies.shared.gait_measures import GaitMeasures


class Quantity(NamedTuple):
    """A column: field of `GaitMeasures`, key in it if it is a map, name, unit, and the unit's share of the SI unit."""

    field: str
    key: str
    name: str
    unit: str
    scale: float = 1.0

    def read(self, gait: GaitMeasures) -> float | None:
        """The value in a gait; None where it has none."""
        value = getattr(gait, self.field)
        if value is not None and self.key:
            value = value.get(self.key)
        return None if value is None else self.scale * float(value)


def quantities(gaits: Sequence[GaitMeasures]) -> list[Quantity]:
    """The columns in which any of the gaits has a value; a template has no torques."""

    def keys(field: str) -> list[str]:
        return list(dict.fromkeys(key for gait in gaits for key in getattr(gait, field) or {}))

    columns = [
        *(Quantity("torque", role, role.replace("_", " "), "N m") for role in keys("torque")),
        Quantity("zmp_outside", "", "ZMP outside", "%", 100.0),
        Quantity("zmp_margin", "", "ZMP margin", "mm", 1e3),
        *(Quantity("h_min", name, f"h {name}", "mm/s", 1e3) for name in keys("h_min")),
        *(Quantity("push", way, f"push {way}", "N s") for way in keys("push")),
        Quantity("certified_area", "", "certified", "m²/s"),
        Quantity("speed", "", "speed", "m/s"),
    ]
    return [column for column in columns if any(column.read(gait) is not None for gait in gaits)]


def table(gaits: Sequence[GaitMeasures]) -> str:
    """One line for each gait."""
    columns = quantities(gaits)
    rows = []
    for gait in gaits:
        named = ", ".join(f"{key} {value:g}" for key, value in gait.values.items())
        ended = "" if gait.ending == "finished" else gait.ending
        rows.append((named, *(q.read(gait) for q in columns), ended))
    return terminal.table(rows, ("gait", *(f"{q.name} [{q.unit}]" for q in columns), ""))
