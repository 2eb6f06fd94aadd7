"""The folder of a campaign: one small Parquet file a run as runs end, one table of all of them at the end.

Each file is complete or not there. The rows of a killed campaign are read back when it is started again, and runs with
a result are not run again.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq

from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.files import folder as folders
from pdhocbf_drake.files.file import new_file, replaced_file
from pdhocbf_drake.files.places import check_entries, part_of, writing
from pdhocbf_drake.simulation.run_folder import REPORT
from pdhocbf_drake.studies.campaign.dispatch import Outcome
from pdhocbf_drake.studies.campaign.pace import Pace
from pdhocbf_drake.studies.campaign.plan import PlannedRun

TABLE: Final = "runs.parquet"
PARTS: Final = "parts"
SUMMARY: Final = "campaign.json"
CAMPAIGN: Final = "campaign.yaml"
ENTRIES: Final = {TABLE, PARTS, SUMMARY, CAMPAIGN, REPORT, ".lock"}  # the last one of earlier versions
FAILED: Final = "failed"
_PART: Final = "run-*.parquet"

# The other columns are the factors and the metrics.
_CORE = (
    ("run", pa.int64()), ("point", pa.int64()), ("barrier", pa.string()), ("status", pa.string()),
    ("attempts", pa.int64()), ("error", pa.string()), ("worker", pa.string()), ("fingerprint", pa.string()),
)  # fmt: skip


class CampaignStore:
    """Results of a campaign in a folder.

    Attributes:
        folder: the folder, made if it does not exist.
        rows: the row of each run with a result, by its number.

    Raises:
        RunFolderError: the folder can't be written, or holds a table that can't be read or another campaign.
    """

    def __init__(self, folder: Path, planned: Sequence[PlannedRun]) -> None:
        self.folder = folder
        self._parts = folder / PARTS
        with writing(folder):
            self._parts.mkdir(parents=True, exist_ok=True)
            probe = new_file(self._parts / "probe")
            try:
                probe.write_bytes(b"0" * 4096)
            finally:
                probe.unlink()
        self.rows: dict[int, dict[str, Any]] = {}
        for table in self._tables():
            self.rows |= {row["run"]: _interned(row) for row in table.to_pylist()}
        fingerprints = {run.run: run.fingerprint for run in planned}
        for run, row in self.rows.items():
            if fingerprints.get(run) != row.get("fingerprint"):
                raise RunFolderError(
                    f"{folder} holds results of another campaign, since its run {run} is not a run of this one; "
                    "choose another --out"
                )

    def forget(self, runs: Sequence[int]) -> None:
        """Drops the rows of runs, so that they are run again; their files are replaced when they end."""
        for run in runs:
            self.rows.pop(run, None)

    def add(self, outcome: Outcome) -> dict[str, Any]:
        """Writes the result of a run and returns its row; raises `RunFolderError`."""
        run = outcome.planned.run
        row = _interned(_row(outcome))
        _write(_table([row]), self._parts / f"run-{run:06d}.parquet")
        self.rows[run] = row
        return row

    def pace(self) -> dict[str, Any]:
        """The pace of the last command that ran something, from campaign.json; null where that is missing."""
        try:
            written = json.loads((self.folder / SUMMARY).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            written = None
        return {name: written.get(name) if isinstance(written, dict) else None for name in Pace(0).summary()}

    def consolidate(self) -> None:
        """Writes one table of all rows, then removes the parts; raises `RunFolderError`."""
        if self.rows:
            _write(_typed(_table([self.rows[run] for run in sorted(self.rows)])), self.folder / TABLE)
        with writing(self.folder):
            for part in self._parts.iterdir():
                if fnmatch(part_of(part) or part.name, _PART):
                    part.unlink()
            with suppress(OSError):  # it holds something else
                self._parts.rmdir()

    def _tables(self) -> Iterator[pa.Table]:
        """The table, then the parts, which are newer."""
        whole = self.folder / TABLE
        if whole.exists():
            try:
                yield pq.read_table(whole)
            except (OSError, pa.ArrowInvalid) as error:
                first = (str(error).splitlines() or [type(error).__name__])[0]
                raise RunFolderError(f"{whole} cannot be read: {first}") from None
        for part in sorted(self._parts.glob(_PART)):
            try:
                with pq.ParquetFile(part) as file:  # a third of the time of `read_table`
                    yield file.read(use_threads=False)
            except (OSError, pa.ArrowInvalid):
                continue  # cut short by a crash of the machine: the run is run again


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keeps other commands from writing into the folder; raises `RunFolderError`, also where it is no campaign's."""
    with writing(folder):
        if folder.is_dir():
            check_entries(folder, ENTRIES, "a folder of campaign", folder)
        folder.mkdir(parents=True, exist_ok=True)
    with folders.locked(folder, f"another campaign is writing to {folder}"):
        yield


def _row(outcome: Outcome) -> dict[str, Any]:
    planned, metrics = outcome.planned, outcome.metrics
    status = FAILED if metrics is None else outcome.status
    row = {
        "run": planned.run, "point": planned.point, "barrier": planned.barrier, "status": status,
        "attempts": outcome.attempts, "error": outcome.error, "worker": outcome.worker,
        "fingerprint": planned.fingerprint,
    }  # fmt: skip
    factors = {path: _plain(value) for path, value in planned.factors.items()}
    return row | factors | {f"metrics.{name}": value for name, value in _flat(metrics or {}).items()}


def _flat(data: dict[str, Any]) -> dict[str, Any]:
    """Nested maps as one, keys joined by dots."""
    flat: dict[str, Any] = {}
    for key, value in data.items():
        if isinstance(value, dict):
            flat |= {f"{key}.{below}": deep for below, deep in _flat(value).items()}
        else:
            flat[key] = value
    return flat


def _plain(value: Any) -> Any:
    """A factor as one cell: numbers as floats, so that all rows have one type; lists and maps as JSON."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    return value if value is None or isinstance(value, (str, bool)) else json.dumps(value)


def _interned(row: dict[str, Any]) -> dict[str, Any]:
    """The row with names that all rows have in common, since there may be a hundred thousand."""
    return {sys.intern(name): value for name, value in row.items()}


def _table(rows: Sequence[dict[str, Any]]) -> pa.Table:
    core = dict(_CORE)
    names = [*core, *dict.fromkeys(name for row in rows for name in row if name not in core)]
    return pa.table({name: pa.array([row.get(name) for row in rows], core.get(name)) for name in names})


def _typed(table: pa.Table) -> pa.Table:
    """The table with its empty columns typed as numbers, since many readers can't read a column of nulls."""
    for index, field in enumerate(table.schema):
        if pa.types.is_null(field.type):
            table = table.set_column(index, field.name, table[field.name].cast(pa.float64()))
    return table


def _write(table: pa.Table, place: Path) -> None:
    """Writes a file that is complete or not there, also after a crash of the machine; raises `RunFolderError`."""
    with replaced_file(place) as staging, staging.open("wb") as stream:
        pq.write_table(table, stream)
        stream.flush()
        os.fsync(stream.fileno())
