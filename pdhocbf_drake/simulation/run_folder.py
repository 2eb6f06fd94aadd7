"""Run folders and other results: written beside their place, and moved there when they are complete."""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Final, NamedTuple

from pdhocbf_drake.config import parse_config, shown
from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.mpc.terms import constraints_of
from pdhocbf_drake.simulation.provenance import Provenance
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.signals import size
from pdhocbf_drake.yaml_text import read_yaml, write_yaml

SCENARIO: Final = "scenario.yaml"
PROVENANCE: Final = "provenance.json"
LOG: Final = "log.npz"
METRICS: Final = "metrics.json"
REPLAY: Final = "replay.html"
REPORT: Final = "report.html"
FIGURES: Final = "figures"
CSV: Final = "log.csv"
MCAP: Final = "log.mcap"

_ENTRIES = {SCENARIO, PROVENANCE, LOG, METRICS, REPLAY, REPORT, FIGURES, CSV, MCAP}


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
        """Writes the scenario with every default, the provenance and the log into a folder that exists."""
        with writing(folder):
            write_yaml(self.scenario.to_dict(), folder / SCENARIO)
            (folder / PROVENANCE).write_text(self.provenance.model_dump_json(indent=2) + "\n", encoding="utf-8")
            self.log.save(folder / LOG)


@contextmanager
def new_run_folder(place: Path, entries: Collection[str] = _ENTRIES) -> Iterator[Path]:
    """A folder to fill; it is moved to `place` when the block ends without an exception, and deleted otherwise.

    Only then does it replace an older run in that place, which may hold such entries alone.

    Raises:
        RunFolderError: `place` cannot be written, holds something that is not a run, or is being written by another
            process.
    """
    place = place.absolute()
    staging = _staging(place)
    with writing(place):
        _check_replaceable(place, entries)
        place.parent.mkdir(parents=True, exist_ok=True)
        lock = _locked(staging, place)
    try:
        yield staging
        with writing(place):
            _move_into_place(staging, place)
    except RunFolderError as error:
        # The message names the user's folder, not the temporary one.
        raise RunFolderError(str(error).replace(str(staging), str(place))) from None
    finally:
        shutil.rmtree(staging, ignore_errors=True)
        os.close(lock)


def read_run(folder: str | Path) -> Run:
    """The run in a folder; raises `RunFolderError`."""
    folder = Path(folder)
    if not folder.is_dir():
        problem = "it is a file" if folder.exists() else "there is no such folder"
        raise RunFolderError(f"{folder} is not a run folder: {problem}")
    missing = [name for name in (SCENARIO, PROVENANCE, LOG) if not (folder / name).is_file()]
    if missing:
        raise RunFolderError(f"{folder} is not a run folder: it has no {', '.join(missing)}")
    try:
        scenario = Scenario.from_dict(read_yaml(folder / SCENARIO), SCENARIO)
        provenance = parse_config(Provenance, read_yaml(folder / PROVENANCE), PROVENANCE)
    except InputError as error:
        raise RunFolderError(f"{folder} is not a run folder of this version: {error}") from None
    log = RunLog.load(folder / LOG)
    needed = {"biped": "robot_state", "vhip": "lip_state", "van_der_pol": "oscillator_state"}[scenario.system]
    if needed not in log:
        raise RunFolderError(f"{folder} is not a run folder: its log is of another scenario, since it has no {needed}")
    barriers = 4 if scenario.system == "van_der_pol" else len(scenario.barriers)
    constraints = len(constraints_of(scenario.mpc))
    for signal in ("h", "barrier_slack", "barrier_active", "unmet"):
        columns = size(signal, barriers=barriers, constraints=constraints)
        there = log[signal].shape[1] if signal in log else 0 if signal == "h" else columns  # older logs have h only
        if there != columns:
            problem = f"its log's {signal} has {there} columns, and its scenario needs {columns}"
            raise RunFolderError(f"{folder} is not a run folder: {problem}")
    return Run(scenario, log, provenance)


@contextmanager
def replaced_file(path: Path) -> Iterator[Path]:
    """A path to write to; it replaces `path` when the block ends without an exception, and is deleted otherwise."""
    staging = _staging(path)
    try:
        with writing(path):
            yield staging
            staging.replace(path)
    finally:
        with suppress(OSError):
            staging.unlink(missing_ok=True)


@contextmanager
def writing(place: Path) -> Iterator[None]:
    """Raises a `RunFolderError` that names `place` for an `OSError` inside."""
    try:
        yield
    except RunFolderError:
        raise
    except OSError as error:
        reason = error.strerror
        files = [parent for parent in place.parents if parent.is_file()]
        if files:
            reason = f"{files[0]} is a file"
        elif isinstance(error, FileNotFoundError):
            reason = f"nothing can be made in {place.parent}"
        raise RunFolderError(f"{shown(str(place))[1:-1]} cannot be written: {reason}") from None


def _staging(place: Path) -> Path:
    """The temporary path beside `place`, with its name, or with the hash of a name near the file system's limit."""
    name = place.name if len(os.fsencode(place.name)) < 240 else hashlib.sha256(os.fsencode(place.name)).hexdigest()
    return place.with_name(f".{name}.part")


def _locked(staging: Path, place: Path) -> int:
    """Makes the staging folder, locks it, and deletes entries of a killed process from it."""
    staging.mkdir(exist_ok=True)
    lock = os.open(staging, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise RunFolderError(f"{place} cannot be written: another run is being written to it") from None
    except OSError:
        pass  # a file system without locks
    for entry in staging.iterdir():
        shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
    return lock


def _check_replaceable(place: Path, entries: Collection[str]) -> None:
    if not place.exists():
        return
    if not place.is_dir():
        raise RunFolderError(f"{place} cannot be written: it is a file")
    others = sorted(entry.name for entry in place.iterdir() if entry.name not in entries)
    if others:
        raise RunFolderError(f"{place} cannot be written: it is not a run folder, since it holds {others[0]}")


def _move_into_place(staging: Path, place: Path) -> None:
    if not place.exists():
        staging.replace(place)
        return
    old = staging.with_suffix(".old")
    shutil.rmtree(old, ignore_errors=True)
    place.replace(old)
    staging.replace(place)
    shutil.rmtree(old, ignore_errors=True)
