"""The user's cache: a folder of files that spare work, of which those used longest ago are deleted at a limit."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

from pdhocbf_drake.files.places import part_of

VARIABLE: Final = "PDHOCBF_CACHE"
"""The environment variable with another folder, or "off"."""

LIMIT: Final = 256 * 2**20
"""The most bytes of all files together."""

SUFFIX: Final = ".walk"


def cache_folder() -> Path | None:
    """Where the files are; None if there is to be no cache, or the user has no home."""
    given = os.environ.get(VARIABLE)
    if given:
        return None if given == "off" else Path(given).absolute()
    try:
        home = Path.home()
    except RuntimeError:
        return None
    if sys.platform == "darwin":
        return home / "Library" / "Caches" / "pdhocbf_drake"
    place = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (place if place.is_absolute() else home / ".cache") / "pdhocbf_drake"


def cache_files(folder: Path) -> list[tuple[Path, int]]:
    """The files of the cache and what killed processes left of some, with their sizes, the last used one first."""
    found = []
    with suppress(OSError):
        for path in folder.iterdir():
            with suppress(OSError):  # another process deletes it
                if (part_of(path) or path.name).endswith(SUFFIX) and path.is_file() and not path.is_symlink():
                    status = path.stat()
                    found.append((status.st_mtime, path, status.st_size))
    return [(path, size) for _, path, size in sorted(found, reverse=True)]


def mark_used(path: Path) -> None:
    """Makes a file the last used one."""
    with suppress(OSError):
        os.utime(path)


def throw_out(folder: Path, limit: int = LIMIT) -> int:
    """Deletes the files that were used longest ago, until the rest is within the limit; returns how many.

    A process that reads one of them goes on reading it.
    """
    total = deleted = 0
    for path, size in cache_files(folder):
        total += size
        if total > limit:
            with suppress(OSError):
                path.unlink()
                deleted += 1
    return deleted
