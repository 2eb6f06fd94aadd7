"""Named arrays in one file: a JSON index, and the arrays behind it, aligned, each once, without their zeros.

A file is complete or not there, and is never changed, only replaced. What is read is what was written or nothing.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from pdhocbf_drake.files.file import replaced_file

_MAGIC: Final = b"pdhocbf arrays 1\n"
_NUMBERS: Final = 3  # after the magic, of eight bytes each: length of the index, of the data, and the CRC-32 of both
_ALIGNED: Final = 64  # [bytes]
_TYPES: Final = ("float64", "int32", "int64")


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray], about: str = "") -> None:
    """Writes arrays of float64, int32 or int64, and a few words about them.

    Raises:
        InputError, RunFolderError: as `replaced_file`.
    """
    data, places = bytearray(), dict[bytes, int]()

    def placed(array: np.ndarray) -> int:
        """Where the array's bytes lie, after they have been added if they are new."""
        raw = array.tobytes()
        if raw not in places:
            places[raw] = len(data)
            data.extend(raw + bytes(-len(raw) % _ALIGNED))
        return places[raw]

    index: dict[str, list[Any]] = {}
    for name, array in arrays.items():
        entry: list[Any] = [_TYPES.index(array.dtype.name), array.shape]
        flat = np.ascontiguousarray(array).ravel()
        used = np.flatnonzero(flat.view(f"i{flat.itemsize}")).astype(np.int32)  # a zero with a sign is kept too
        sparse = len(used) * (flat.itemsize + 4) < flat.nbytes
        index[name] = [*entry, placed(flat[used]), placed(used), len(used)] if sparse else [*entry, placed(flat)]
    text = json.dumps([about, index], separators=(",", ":")).encode()
    text += b" " * (-(len(_MAGIC) + 8 * _NUMBERS + len(text)) % _ALIGNED)
    numbers = np.array([len(text), len(data), zlib.crc32(data, zlib.crc32(text))], dtype="<i8")
    with replaced_file(path) as staging, staging.open("wb") as stream:
        stream.writelines((_MAGIC, numbers.tobytes(), text, data))


class Arrays(Mapping[str, np.ndarray]):
    """The arrays of a file, which has been read; each is made when it is asked for.

    Attributes:
        about: the words that were written with them.
    """

    def __init__(self, about: str, index: Mapping[str, list[Any]], data: memoryview) -> None:
        self.about, self._index, self._data = about, index, data

    def __len__(self) -> int:
        return len(self._index)

    def __iter__(self) -> Iterator[str]:
        return iter(self._index)

    def __contains__(self, name: object) -> bool:
        return name in self._index

    def __getitem__(self, name: str) -> np.ndarray:
        return _array(self._index[name], self._data)


def read_arrays(path: Path) -> Arrays | None:
    """The arrays; None for no file, a torn one, and one of something else."""
    found = _read(path)
    if found is None:
        return None
    (about, index), data = found
    return Arrays(about, index, data)


def _read(path: Path) -> tuple[Any, memoryview] | None:
    """Index and data of a file that is as it was written."""
    try:
        raw = memoryview(path.read_bytes())
    except OSError:
        return None
    start = len(_MAGIC) + 8 * _NUMBERS
    if bytes(raw[: len(_MAGIC)]) != _MAGIC or len(raw) < start:
        return None
    text_size, data_size, checksum = np.frombuffer(raw[len(_MAGIC) : start], dtype="<i8").tolist()
    if text_size + data_size != len(raw) - start or zlib.crc32(raw[start:]) != checksum:
        return None
    return json.loads(bytes(raw[start : start + text_size])), raw[start + text_size :]


def _array(entry: list[Any], data: memoryview) -> np.ndarray:
    kind, shape, place, *sparse = entry
    dtype = np.dtype(_TYPES[kind])
    if not sparse:
        return np.frombuffer(data, dtype, int(np.prod(shape)), place).reshape(shape)
    where, count = sparse
    array = np.zeros(shape, dtype)
    array.reshape(-1)[np.frombuffer(data, np.int32, count, where)] = np.frombuffer(data, dtype, count, place)
    return array
