"""A run and its folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Final, NamedTuple

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.files.file import replaced_file, write_text
from pdhocbf_drake.files.folder import left_parts, new_folder
from pdhocbf_drake.files.places import writing
from pdhocbf_drake.simulation.log_rows import delete_rows
from pdhocbf_drake.simulation.provenance import Provenance
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.signals import size
from pdhocbf_drake.yaml_text import read_yaml, write_yaml

SCENARIO: Final = "scenario.yaml"
PROVENANCE: Final = "provenance.json"
LOG: Final = "log.npz"
ROWS: Final = "log.rows"  # of a run that goes on, or whose process was killed
METRICS: Final = "metrics.json"
REPLAY: Final = "replay.html"
REPORT: Final = "report.html"
FIGURES: Final = "figures"
CSV: Final = "log.csv"
MCAP: Final = "log.mcap"

ENTRIES: Final = {SCENARIO, PROVENANCE, LOG, METRICS, REPLAY, REPORT, FIGURES, CSV, MCAP}


class Run(NamedTuple):
    """A run: its scenario, its log and its provenance."""

    scenario: Scenario
    log: RunLog
    provenance: Provenance

    @classmethod
    def of(cls, scenario: Scenario, log: RunLog, wall_seconds: float = 0.0) -> Run:
        """A run that this process has simulated within `wall_seconds` of wall time [s], which ended now."""
        started = datetime.now(timezone.utc) - timedelta(seconds=wall_seconds)
        return cls(scenario, log, Provenance.of_run(scenario, started, wall_seconds))

    def save(self, folder: Path) -> None:
        """Writes the scenario with every default, the provenance and the log into a folder."""
        _save_origin(self.scenario, self.provenance, folder)
        with writing(folder):
            self.log.save(folder / LOG)
        delete_rows(folder / ROWS)


def begin_run(scenario: Scenario, folder: Path) -> Path:
    """Writes to a folder what is needed to read the rows of a run that is killed; returns the place of these."""
    _save_origin(scenario, Provenance.of_run(scenario, datetime.now(timezone.utc), 0.0), folder)
    return folder / ROWS


def _save_origin(scenario: Scenario, provenance: Provenance, folder: Path) -> None:
    with replaced_file(folder / SCENARIO) as staging:
        write_yaml(scenario.to_dict(), staging)
    write_text(folder / PROVENANCE, provenance.model_dump_json(indent=2) + "\n")


@contextmanager
def new_run_folder(place: Path) -> Iterator[Path]:
    """The path of a `new_folder` for a run."""
    with new_folder(place, ENTRIES) as new:
        yield new.path


def read_run(folder: str | Path) -> Run:
    """The run in a folder, or what a process that was killed has recorded of it; raises `RunFolderError`."""
    folder = Path(folder)
    killed = None if (folder / LOG).is_file() else _killed(folder)
    if killed is None and not folder.is_dir():
        problem = "it is a file" if folder.exists() else "there is no such folder"
        raise RunFolderError(f"{folder} is not a run folder: {problem}")
    folder = killed or folder
    needed = (SCENARIO, PROVENANCE) if killed else (SCENARIO, PROVENANCE, LOG)
    missing = [name for name in needed if not (folder / name).is_file()]
    if missing:
        raise RunFolderError(f"{folder} is not a run folder: it has no {', '.join(missing)}")
    try:
        scenario = Scenario.from_dict(read_yaml(folder / SCENARIO), SCENARIO)
        provenance = parse_config(Provenance, read_yaml(folder / PROVENANCE), PROVENANCE)
    except InputError as error:
        raise RunFolderError(f"{folder} is not a run folder of this version: {error}") from None
    from pdhocbf_drake.mpc.terms import constraints_of  # here, since it loads Drake: what is no run is refused at once

    log = RunLog.of_killed(folder / ROWS) if killed else RunLog.load(folder / LOG)
    state = {"biped": "robot_state", "vhip": "lip_state", "van_der_pol": "oscillator_state"}[scenario.system]
    if state not in log:
        raise RunFolderError(f"{folder} is not a run folder: its log is of another scenario, since it has no {state}")
    barriers = 4 if scenario.system == "van_der_pol" else len(scenario.barriers)
    constraints = len(constraints_of(scenario.mpc))
    for signal in ("h", "barrier_slack", "barrier_active", "unmet"):
        columns = size(signal, barriers=barriers, constraints=constraints)
        there = log[signal].shape[1] if signal in log else 0 if signal == "h" else columns  # older logs have h only
        if there != columns:
            problem = f"its log's {signal} has {there} columns, and its scenario needs {columns}"
            raise RunFolderError(f"{folder} is not a run folder: {problem}")
    return Run(scenario, log, provenance)


def _killed(place: Path) -> Path | None:
    """The folder with the rows of a run whose process was killed: `place`, or the last that it was filled in."""
    found = [part for part in (place, *left_parts(place)) if (part / ROWS).is_dir()]
    return max(found, key=lambda part: part.stat().st_mtime, default=None)
