"""The command of a study whose result is a table of what walks must reach."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.terminal import shown_progress


def run_table(
    options: argparse.Namespace,
    name: str,
    separator: str,
    load: Callable[[], tuple[Callable[..., Any], Callable[..., Any]]],
    **chosen: Any,
) -> None:
    """Walks the rows that are asked for, writes and prints.

    Args:
        options: with scenario, text, rows, workers and out.
        name: of the study and of its JSON file.
        separator: of the rows.
        load: gives the functions that plan and do the study; it may load Drake, since all options are checked before.
        chosen: what both functions take besides scenario and rows.
    """
    scenario = load_scenario(options.scenario, options.text)
    rows = None if options.rows is None else [row.strip() for row in options.rows.split(separator) if row.strip()]
    if options.workers < 1:
        raise InputError(f"workers must be 1 or more (given: {options.workers})")
    folder: Path = options.out or Path("runs") / f"{name}-{scenario.name}"
    plan, study = load()
    from pdhocbf_drake.studies.shared.check_table import table

    with shown_progress(name, len(plan(scenario, rows, **chosen)), "walks") as progress:
        checks, notes = study(
            scenario, rows=rows, workers=options.workers, out=folder, progress=lambda done: progress(done), **chosen
        )
    print(table(checks, notes), flush=True)
    print(f"wrote {folder / name}.json")
