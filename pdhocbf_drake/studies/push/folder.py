"""The folder of `pdhocbf push` and `pdhocbf worth`, proved to be writable before minutes are spent."""

from __future__ import annotations

from pathlib import Path

from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.simulation.run_folder import SCENARIO, replaced_file
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.yaml_text import write_yaml


def result_folder(out: Path | None, verb: str, scenario: Scenario) -> Path:
    """`out`, or ./runs/VERB-NAME, with the scenario already in it; raises `RunFolderError`."""
    folder = out or Path("runs") / f"{verb}-{scenario.name}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunFolderError(f"{folder} cannot be written: {error.strerror}") from None
    with replaced_file(folder / SCENARIO) as staging:
        write_yaml(scenario.to_dict(), staging)
    return folder
