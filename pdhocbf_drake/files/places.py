"""Places for results: what may be written there, checked before the work, and one sentence where it may not."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import stat
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from pdhocbf_drake.config_errors import shown
from pdhocbf_drake.errors import InputError, RunFolderError

_KINDS: Final = {
    stat.S_IFDIR: "a folder", stat.S_IFREG: "a file", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device", stat.S_IFBLK: "a device",
}  # fmt: skip
_PARTS: Final = re.compile(r"\.(?P<name>.+)\.[0-9a-f]{16}\.part")  # the names of `beside`
_INSIDE: Final = (
    ".png",
    ".csv",
    ".parquet",
    ".obj",
    ".gltf",
)  # files in the folders of results


def named(path: Path) -> str:
    """The whole path for a message, on one line whatever characters it has."""
    return repr(str(path))[1:-1]


@contextmanager
def writing(place: Path) -> Iterator[None]:
    """Raises a `RunFolderError` that names `place` for an `OSError` inside."""
    try:
        yield
    except RunFolderError:
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        files = [parent for parent in place.parents if parent.is_file()]
        if files:
            reason = f"{files[0]} is a file"
        elif isinstance(error, FileNotFoundError):
            reason = f"nothing can be made in {place.parent}"
        raise RunFolderError(f"{named(place)} cannot be written: {reason}") from None


def kind_of(place: Path) -> str:
    """What is there, such as "a folder", "a file" or "a device", through symbolic links; "" for nothing."""
    try:
        mode = place.stat().st_mode
    except FileNotFoundError:
        return ""
    except ValueError:  # a NUL byte
        raise InputError(f"nothing can be called {shown(str(place))}") from None
    return _KINDS.get(stat.S_IFMT(mode), "something else")


def check_file(path: Path) -> Path:
    """The file that `path` means, through symbolic links, after all that can be checked before it is written.

    Raises:
        InputError: a folder, device, pipe or socket is there.
        RunFolderError: the file, or the first folder above it that exists, can't be written.
    """
    with writing(path):
        if (kind := kind_of(path)) not in ("", "a file"):
            raise InputError(f"{named(path)} is {kind}; the name of a file is needed")
        target = Path(os.path.realpath(path))
        above = next(parent for parent in target.parents if parent.exists())
        if not above.is_dir():
            raise NotADirectoryError
        if not os.access(above, os.W_OK | os.X_OK) or (kind and not os.access(target, os.W_OK)):
            raise PermissionError(None, "Permission denied")
    return target


def beside(place: Path) -> Path:
    """A new name next to `place`: hidden, random, and ending in ".part"; a long name is replaced by its hash."""
    name = place.name if len(os.fsencode(place.name)) < 230 else hashlib.sha256(os.fsencode(place.name)).hexdigest()
    return place.with_name(f".{name}.{secrets.token_hex(8)}.part")


def part_of(entry: Path) -> str | None:
    """The name that a name of `beside` was made from; None for any other name."""
    match = _PARTS.fullmatch(entry.name)
    return match["name"] if match else None


def check_entries(folder: Path, entries: Collection[str], what: str, place: Path) -> None:
    """Refuses a folder that holds anything but results: these entries, those without an ending being folders.

    Raises:
        RunFolderError: names the first entry that does not belong to `what`, a run folder for example.
    """
    for entry in sorted(folder.iterdir()):
        name, other = part_of(entry) or entry.name, ""
        if name not in entries and not (name == folder.name and part_of(entry)):
            other = entry.name
        elif entry.is_dir() and not entry.is_symlink() and not part_of(entry):
            inside = sorted(entry.iterdir()) if not entry.suffix else [entry]
            strange = (one for one in inside if one.is_dir() or (one.suffix not in _INSIDE and not part_of(one)))
            other = next((str(one.relative_to(folder)) for one in strange), "")
        if other:
            raise RunFolderError(f"{place} cannot be written: it is not {what}, since it holds {other}")
