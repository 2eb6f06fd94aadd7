"""The rows of a log on disk while a run goes on: they need no memory, and stay if the process is killed.

A folder with one file a signal: T rows of its elements as float64, one after another, without a header. `columns.json`
has the number of elements of each. A row that was not written whole is none.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Final

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.files.places import writing

Array = NDArray[np.float64]

TIME: Final = "time"
_COLUMNS: Final = "columns.json"
_SUFFIX: Final = ".rows"
_NUMBER: Final = np.dtype(float)


class MappedTables(Mapping[str, Array]):
    """The table of each signal, (T, size), which takes memory only while it is used.

    The files stay open, so that they can be moved and deleted meanwhile.
    """

    def __init__(self, files: Mapping[str, IO[bytes]], columns: Mapping[str, int], start: int, stop: int) -> None:
        self._files, self._columns = files, columns
        self._start, self._stop = start, max(start, stop)

    def __getitem__(self, name: str) -> Array:
        columns, count = self._columns[name], self._stop - self._start
        if not columns * count:
            return np.zeros((count, columns))
        offset = self._start * columns * _NUMBER.itemsize
        return np.asarray(np.memmap(self._files[name], _NUMBER, "r", offset, (count, columns)))

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def rows(self, start: int, stop: int) -> MappedTables:
        """The same signals from row `start` to before row `stop`."""
        return MappedTables(self._files, self._columns, self._start + start, min(self._stop, self._start + stop))


class LogRows:
    """Writes a log's rows to a folder, which it makes.

    Args:
        folder: its place.
        columns: number of elements of each signal.

    Attributes:
        count: rows that are there.
        broken: whether rows could not be written, of a full disk for example; nothing is written from then on.

    Raises:
        RunFolderError: the folder can't be made.
    """

    def __init__(self, folder: Path, columns: Mapping[str, int]) -> None:
        self._folder = folder
        self.count, self.broken = 0, False
        with writing(folder):
            folder.mkdir()
            (folder / _COLUMNS).write_text(json.dumps(dict(columns)), encoding="utf-8")
            self._files = {name: (folder / f"{name}{_SUFFIX}").open("ab", buffering=0) for name in (*columns, TIME)}

    def append(self, tables: Mapping[str, Array], time: Array) -> bool:
        """Writes rows, their times last; returns whether they are there."""
        try:
            for name, values in (*tables.items(), (TIME, time)) if not self.broken else ():
                data = np.ascontiguousarray(values, float).tobytes()
                while data:
                    data = data[self._files[name].write(data) :]
        except OSError:
            self.broken = True
        self.count += 0 if self.broken else len(time)
        return not self.broken

    def read(self) -> tuple[MappedTables, Array]:
        """All rows that are there, and their times [s], (count,)."""
        for file in self._files.values():
            file.close()
        return read_rows(self._folder, self.count)


def read_rows(folder: Path, most: int | None = None) -> tuple[MappedTables, Array]:
    """The whole rows in a folder of `LogRows`, `most` at most, and their times [s], (T,); raises `RunFolderError`."""
    try:
        columns = json.loads((folder / _COLUMNS).read_text(encoding="utf-8"))
        if not isinstance(columns, dict) or not all(type(count) is int and count >= 0 for count in columns.values()):
            raise RunFolderError(f"{folder} has no rows of a run: its {_COLUMNS} is damaged")
        widths = {**columns, TIME: 1}
        files = {name: (folder / f"{name}{_SUFFIX}").open("rb") for name in widths}
        sizes = {name: (folder / f"{name}{_SUFFIX}").stat().st_size for name in widths}
    except (OSError, ValueError) as error:
        raise RunFolderError(f"{folder} has no rows of a run: {error}") from None
    count = min(sizes[name] // (width * _NUMBER.itemsize) for name, width in widths.items() if width)
    count = count if most is None else min(count, most)
    return MappedTables(files, columns, 0, count), MappedTables(files, {TIME: 1}, 0, count)[TIME][:, 0].copy()


def delete_rows(folder: Path) -> None:
    """Deletes a folder of `LogRows`; those who have it open can go on reading."""
    shutil.rmtree(folder, ignore_errors=True)
