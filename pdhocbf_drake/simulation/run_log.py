"""The log of a run: every signal at every tick, and how the run ended."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from numpy.lib.format import write_array
from numpy.typing import NDArray

from pdhocbf_drake.errors import InputError, RunFolderError
from pdhocbf_drake.files.file import replaced_file
from pdhocbf_drake.simulation.log_rows import MappedTables, read_rows
from pdhocbf_drake.systems.signals import LOGGED

Array = NDArray[np.float64]

FINISHED: Final = "finished"
FELL: Final = "fell"
INTERRUPTED: Final = "interrupted"
FAILED: Final = "failed"

_ELEMENTS = {signal.name: signal.elements for signal in LOGGED}
_SIZES = {signal.name: signal.size for signal in LOGGED}
_RESERVED = ("time", "ending")
_RENAMED = {"velocity_bound": "barrier_bound"}  # present names of signals in older logs


class RunLog:
    """A table with one row per tick.

    Row k holds the state measured at tick k, before that tick's update, and the references *for* tick k.

    Attributes:
        time: (T,) times of the rows [s].
        signals: each (T, size) by its name in `systems.signals`, in the units given there.
        ending: "finished", or the reason of an early end: "fell", "interrupted", "failed: …".

    Raises:
        InputError: the time is no vector, or a signal no table with a row for each of its elements.
    """

    def __init__(self, signals: Mapping[str, Array], time: Array, ending: str = FINISHED) -> None:
        self.time: Array = np.asarray(time, dtype=float)
        self.ending = ending
        if self.time.ndim != 1:
            raise InputError(f"a log's time must be one row of numbers, given shape {self.time.shape}")
        if isinstance(signals, MappedTables):
            self.signals: Mapping[str, Array] = signals
            return
        tables = {name: np.asarray(values, dtype=float) for name, values in signals.items()}
        for name, table in tables.items():
            if name in _RESERVED:
                raise InputError(f"a log's signal cannot be called '{name}', which is a column of its own")
            if table.ndim != 2 or len(table) != len(self.time):
                raise InputError(f"signal '{name}' must have shape ({len(self.time)}, size), given {table.shape}")
        self.signals = tables

    @property
    def complete(self) -> bool:
        """Whether the run reached its end."""
        return self.ending == FINISHED

    def __len__(self) -> int:
        return len(self.time)

    def __contains__(self, name: object) -> bool:
        return name in self.signals

    def __getitem__(self, name: str) -> Array:
        """A signal's table, (T, size); raises `InputError` for one that is not in the log."""
        if name not in self.signals:
            raise InputError(f"the log has no signal '{name}'; it has {', '.join(sorted(self.signals))}")
        return self.signals[name]

    def element(self, name: str, element: str) -> Array:
        """One named column of a signal, (T,); raises `InputError` for a name that is not in `systems.signals`."""
        names = _ELEMENTS.get(name, ())
        if element not in names:
            exist = ", ".join(names) or "no named ones"
            raise InputError(f"signal '{name}' has no element '{element}'; it has {exist}")
        return self[name][:, names.index(element)]

    def after(self, time: float) -> RunLog:
        """The rows from `time` on (half a microsecond early, against rounding)."""
        return self._rows(int(np.searchsorted(self.time, time - 5e-7)), len(self))

    def finite(self) -> RunLog:
        """The rows before the first one with NaN or infinity."""
        finite = np.ones(len(self), bool)
        for table in self.signals.values():
            finite &= np.isfinite(table).all(axis=1)
        return self._rows(0, len(self) if finite.all() else int(finite.argmin()))

    def _rows(self, start: int, stop: int) -> RunLog:
        tables = self.signals
        if isinstance(tables, MappedTables):
            tables = tables.rows(start, stop)
        else:
            tables = {name: table[start:stop] for name, table in tables.items()}
        return RunLog(tables, self.time[start:stop], self.ending)

    def save(self, path: Path) -> None:
        """Writes an `.npz` that numpy can read; raises as `replaced_file` does."""
        path = path if path.suffix == ".npz" else path.with_name(f"{path.name}.npz")
        with replaced_file(path) as staging, zipfile.ZipFile(staging, "w", zipfile.ZIP_DEFLATED) as archive:
            for name in (*self.signals, *_RESERVED):  # one at a time, since a long log is larger than memory should be
                value = self.signals[name] if name in self.signals else np.asarray(getattr(self, name))
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                    write_array(member, value, allow_pickle=False)

    @classmethod
    def load(cls, path: Path) -> RunLog:
        """The log in a file of `save`, signals of older logs under their present names; raises `RunFolderError`."""
        problem = ""
        try:
            if not zipfile.is_zipfile(path):
                path.open("rb").close()  # raises where the file is missing or unreadable
                raise InputError("it is no .npz file, or a damaged one")
            with np.load(path, allow_pickle=False) as data:
                signals = {_RENAMED.get(name, name): data[name] for name in data.files if name not in _RESERVED}
                if not all(table.dtype.kind in "fiub" for table in (*signals.values(), data["time"])):
                    raise InputError("it is damaged")
                log = cls(signals, data["time"], str(data["ending"]))
            problem = log._problem()
        except FileNotFoundError:
            raise RunFolderError(f"{path} does not exist") from None
        except OSError as error:
            raise RunFolderError(f"{path} cannot be read: {error.strerror or 'it is damaged'}") from None
        except InputError as error:
            problem = str(error)
        except KeyError as error:
            problem = f"it has no {error.args[0]}"
        except (ValueError, EOFError, zipfile.BadZipFile, zlib.error):
            problem = "it is damaged"
        if problem:
            raise RunFolderError(f"{path} is not a run's log: {problem}")
        return log

    @classmethod
    def of_killed(cls, folder: Path) -> RunLog:
        """The log of a run whose process was killed, from the rows that it left; raises `RunFolderError`."""
        tables, time = read_rows(folder)
        log = cls(tables, time, INTERRUPTED)
        if problem := log._problem():
            raise RunFolderError(f"{folder} has no rows of a run: {problem}")
        return log

    def _problem(self) -> str:
        """The reason why these can't be the signals of a run; empty if they can."""
        if not np.isfinite(self.time).all() or not (np.diff(self.time) > 0).all():
            return "its time does not grow from row to row"
        for name, table in self.signals.items():
            if name == "gait_phase" and not np.isfinite(table).all():
                return "signal 'gait_phase', the gait's clock, is no number in some rows"
            size = _SIZES.get(name)
            if isinstance(size, int) and table.shape[1] != size:
                return f"signal '{name}' has {table.shape[1]} columns, {size} are needed"
        return ""
