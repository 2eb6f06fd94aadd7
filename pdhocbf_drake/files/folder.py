"""A folder of results that is complete or not there: filled out of sight, and moved to its place at the end."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager, nullcontext
from itertools import count
from pathlib import Path
from typing import Final

from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.files.places import beside, check_entries, kind_of, named, part_of, writing

_MARK: Final = ".pdhocbf"  # an empty file in each folder that `new_folder` fills


class NewFolder:
    """A folder to fill.

    Attributes:
        path: where its files are written.
        finished: whether they have been moved to their place, or could not be and stay in `path`.
        saved: where folders are now that killed processes have left of it, and that held something to keep.
    """

    def __init__(self, path: Path, place: Path, entries: Collection[str], what: str) -> None:
        self.path, self.finished, self.saved = path, False, list[Path]()
        self._place, self._home, self._entries, self._what = place, Path(os.path.realpath(place)), entries, what

    def finish(self) -> None:
        """Moves the files to their place, where older ones are deleted.

        Raises:
            RunFolderError: they can't be moved; the message says where they are.
        """
        self.finished = True
        try:
            with writing(self._place):
                (self.path / _MARK).unlink()
                if not self._home.exists():
                    self.path.rename(self._home)
                    return
                check_entries(self._home, self._entries, self._what, self._place)
                _exchange(self.path, self._home)
        except RunFolderError as error:
            raise RunFolderError(f"{error}; what was made is in {self.path}") from None


@contextmanager
def new_folder(
    place: Path, entries: Collection[str], what: str = "a run folder", keep: str = ""
) -> Iterator[NewFolder]:
    """A folder to fill; it is finished when the block ends without an exception, and deleted otherwise.

    It is filled inside `place` where that exists, beside it otherwise. Links are followed. Of what is in `place`
    already, only the given entries are replaced, and nothing else may be there. What a killed process has left of
    `place` is deleted, or, if it has an entry `keep`, moved beside `place`, under its name and "-killed".

    Raises:
        RunFolderError: `place` cannot be written, holds something else than `what`, or is being written by another
            process.
    """
    place = place.absolute()
    with writing(place):
        if (kind := kind_of(place)) not in ("", "a folder"):
            raise RunFolderError(f"{place} cannot be written: it is {kind}")
        home = Path(os.path.realpath(place))
        if kind:
            check_entries(home, entries, what, place)
        home.parent.mkdir(parents=True, exist_ok=True)
        path = beside(home / home.name if kind else home)
        path.mkdir()
    new = NewFolder(path, place, entries, what)
    busy = f"{place} cannot be written: another run is being written to it"
    try:
        # The second lock is for the pages that are written after `finish`; else the first one moves with its folder.
        with locked(path, busy), locked(home, busy) if kind else nullcontext():
            with writing(place):
                (path / _MARK).touch()
                new.saved += _clear_others(home, path, busy, keep)
            yield new
            if not new.finished:
                new.finish()
    except RunFolderError as error:
        if new.finished:
            raise
        # The message names the user's folder, not the temporary one.
        raise RunFolderError(str(error).replace(named(path), named(place))) from None
    finally:
        if not new.finished:
            shutil.rmtree(path, ignore_errors=True)


@contextmanager
def locked(folder: Path, busy: str) -> Iterator[bool]:
    """Keeps other commands from writing to a folder; yields False where the file system has no locks.

    Raises:
        RunFolderError: another command is writing to it; with the sentence `busy`.
    """
    with writing(folder):
        descriptor = os.open(folder, os.O_RDONLY)
    try:
        lock = True
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise RunFolderError(busy) from None
        except OSError:
            lock = False
        yield lock
    finally:
        os.close(descriptor)


def left_parts(place: Path) -> list[Path]:
    """The folders that `new_folder` is filling for a place, or that a killed process was."""
    home = Path(os.path.realpath(place))
    return [part for folder in (home, home.parent) for part in _parts(folder, part_of(beside(home)))]


def _clear_others(home: Path, own: Path, busy: str, keep: str) -> list[Path]:
    """Deletes what killed processes of this user left of `home`; raises `RunFolderError` for one that is alive.

    Those with an entry `keep` are moved; their new places are returned.
    """
    saved = []
    for other in left_parts(home):
        if other != own and other.exists():
            with locked(other, busy) as dead:
                if not dead or other.stat().st_uid != os.geteuid():
                    continue
                if not keep or not (other / keep).exists():
                    shutil.rmtree(other, ignore_errors=True)
                elif moved := _moved(other, home.with_name(f"{home.name}-killed")):
                    saved.append(moved)
    return saved


def _moved(folder: Path, place: Path) -> Path | None:
    """Moves a folder to a place, or to the first free one of its name and a number; None where that can't be done."""
    for number in count(1):
        target = place if number == 1 else place.with_name(f"{place.name}-{number}")
        if target.exists():
            continue
        try:
            folder.rename(target)
            (target / _MARK).unlink()
        except OSError:
            return None
        return target
    return None


def _parts(folder: Path, name: str | None) -> list[Path]:
    """The folders that `new_folder` has made in a folder for a place of that name."""
    try:
        found = [entry for entry in folder.iterdir() if part_of(entry) == name and not entry.is_symlink()]
        return [entry for entry in found if (entry / _MARK).is_file()]
    except OSError:  # it does not exist, or can't be listed
        return []


def _exchange(path: Path, home: Path) -> None:
    """Moves what is in `path` to `home`, and deletes what is in `home`; all stays as it was if that can't be done."""
    entries = [entry for entry in home.iterdir() if not (part_of(entry) and entry.is_dir())]
    old = beside(home / home.name)
    old.mkdir()
    moves = [(entry, old / entry.name) for entry in entries]
    moves += [(entry, home / entry.name) for entry in path.iterdir()]
    done = []
    try:
        for source, target in moves:
            source.rename(target)
            done.append((source, target))
    except OSError:
        for source, target in reversed(done):
            target.rename(source)
        old.rmdir()
        raise
    shutil.rmtree(old, ignore_errors=True)
    path.rmdir()
