"""The folder that a study writes its results to, and JSON without NaN."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from pdhocbf_drake.simulation.run_folder import SCENARIO, replaced_file, writing
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.yaml_text import write_yaml


def result_folder(out: Path | None, verb: str, scenario: Scenario) -> Path:
    """`out`, or ./runs/VERB-NAME, with the scenario written to it; raises `RunFolderError` if it can't be written."""
    folder = out or Path("runs") / f"{verb}-{scenario.name}"
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    with replaced_file(folder / SCENARIO) as staging:
        write_yaml(scenario.to_dict(), staging)
    return folder


def write_text(path: Path, text: str) -> None:
    """Writes a file that is complete or not there; raises `RunFolderError`."""
    with replaced_file(path) as staging:
        staging.write_text(text + "\n", encoding="utf-8")


def write_json(path: Path, data: Any, indent: int = 1) -> None:
    """As `write_text`, with null for NaN and infinity."""
    write_text(path, json.dumps(_plain(data), indent=indent, allow_nan=False, ensure_ascii=False))


def _plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _plain(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [_plain(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
