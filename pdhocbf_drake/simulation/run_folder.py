"""The folder that a run leaves: written beside its place and moved there when it is complete."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, NamedTuple

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.simulation.provenance import Provenance
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.yaml_text import read_yaml, write_yaml

SCENARIO: Final = "scenario.yaml"
PROVENANCE: Final = "provenance.json"
LOG: Final = "log.npz"
METRICS: Final = "metrics.json"
REPLAY: Final = "replay.html"
REPORT: Final = "report.html"
FIGURES: Final = "figures"

_ENTRIES = {SCENARIO, PROVENANCE, LOG, METRICS, REPLAY, REPORT, FIGURES}


class Run(NamedTuple):
    """What was run, what was recorded, and where that came from."""

    scenario: Scenario
    log: RunLog
    provenance: Provenance


@contextmanager
def new_run_folder(place: Path, entries: Collection[str] = _ENTRIES) -> Iterator[Path]:
    """A folder to fill; it becomes `place` when the block ends well, and nothing is left of it otherwise.

    An older run in that place, which holds nothing but such entries, is replaced at that moment and not before.

    Raises:
        RunFolderError: `place` cannot be written, or holds something that is not a run.
    """
    place = place.absolute()
    _check_replaceable(place, entries)
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{place.name}-", dir=place.parent))
    except OSError as error:
        raise RunFolderError(f"no run can be written to {place}: {error.strerror}") from None
    try:
        staging.chmod(0o755)  # mkdtemp makes it private, and a run is not
        yield staging
        _move_into_place(staging, place)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def write_run(folder: Path, run: Run) -> None:
    """Writes the scenario with every default, the provenance and the log."""
    write_yaml(run.scenario.to_dict(), folder / SCENARIO)
    (folder / PROVENANCE).write_text(run.provenance.model_dump_json(indent=2) + "\n", encoding="utf-8")
    run.log.save(folder / LOG)


def read_run(folder: Path) -> Run:
    """Reads what `write_run` wrote; raises `RunFolderError`."""
    if not folder.is_dir():
        raise RunFolderError(f"{folder} is not a run folder: there is no such folder")
    missing = [name for name in (SCENARIO, PROVENANCE, LOG) if not (folder / name).is_file()]
    if missing:
        raise RunFolderError(f"{folder} is not a run folder: it has no {', '.join(missing)}")
    try:
        scenario = Scenario.from_dict(read_yaml(folder / SCENARIO), SCENARIO)
        provenance = parse_config(Provenance, read_yaml(folder / PROVENANCE), PROVENANCE)
    except InputError as error:
        raise RunFolderError(f"{folder} is not a run folder of this version: {error}") from None
    return Run(scenario, RunLog.load(folder / LOG), provenance)


@contextmanager
def replaced_file(path: Path) -> Iterator[Path]:
    """A path to write to; it replaces `path` when the block ends well, and nothing is left of it otherwise."""
    staging = path.with_name(f".{path.name}.part")
    try:
        yield staging
        staging.replace(path)
    except OSError as error:
        raise RunFolderError(f"{path} cannot be written: {error.strerror}") from None
    finally:
        staging.unlink(missing_ok=True)


def _check_replaceable(place: Path, entries: Collection[str]) -> None:
    if not place.exists():
        return
    if not place.is_dir():
        raise RunFolderError(f"no run can be written to {place}: it is a file")
    try:
        strangers = sorted(entry.name for entry in place.iterdir() if entry.name not in entries)
    except OSError as error:
        raise RunFolderError(f"no run can be written to {place}: {error.strerror}") from None
    if strangers:
        raise RunFolderError(f"no run can be written to {place}: it is not a run folder, since it holds {strangers[0]}")


def _move_into_place(staging: Path, place: Path) -> None:
    try:
        if place.exists():
            old = Path(tempfile.mkdtemp(prefix=f".{place.name}-old-", dir=place.parent))
            place.replace(old / place.name)
            staging.replace(place)
            shutil.rmtree(old, ignore_errors=True)
        else:
            staging.replace(place)
    except OSError as error:
        raise RunFolderError(f"no run can be written to {place}: {error.strerror}") from None
