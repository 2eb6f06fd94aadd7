"""The table "what it must reach" of a study, as text and as data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pdhocbf_drake import terminal
from pdhocbf_drake.files.file import write_text
from pdhocbf_drake.simulation.run_folder import SCENARIO
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.checks import Check
from pdhocbf_drake.studies.shared.results import write_json
from pdhocbf_drake.yaml_text import write_yaml


def table(checks: Sequence[Check], notes: Sequence[str] = ()) -> str:
    """One line for each check, then a line for each note."""
    rows = [
        (check.row, check.what, check.value, f"{check.relation} {check.limit:g}", check.unit, _answer(check))
        for check in checks
    ]
    lines = terminal.table(rows, ("walk", "measured", "value", "limit", "unit", "holds"))
    return "\n".join([lines, *(["", *notes] if notes else [])])


def document(scenario: Scenario, checks: Sequence[Check], notes: Sequence[str]) -> dict[str, Any]:
    """The contents of a study's JSON file."""
    found = [{**check._asdict(), "holds": check.holds} for check in checks]
    return {"scenario": scenario.name, "holds": all(check.holds for check in checks), "checks": found, "notes": notes}


def write_table(
    folder: Path, text: str, data: str, scenario: Scenario, checks: Sequence[Check], notes: Sequence[str]
) -> None:
    """Writes the table as text and as data under these names, and the scenario, into a folder."""
    write_text(folder / text, table(checks, notes) + "\n")
    write_json(folder / data, document(scenario, checks, notes))
    write_yaml(scenario.to_dict(), folder / SCENARIO)


def _answer(check: Check) -> str:
    return "yes" if check.holds else "NO"
