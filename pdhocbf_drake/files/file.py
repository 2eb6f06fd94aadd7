"""A file that is complete or not there."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pdhocbf_drake.files.places import beside, check_file, writing


@contextmanager
def replaced_file(path: Path) -> Iterator[Path]:
    """A path to write to; it replaces `path` when the block ends without an exception, and is deleted otherwise.

    Folders above it are made. A symbolic link stays, and its target is replaced.

    Raises:
        InputError: a folder, device, pipe or socket is there. RunFolderError: `path` can't be written.
    """
    target = check_file(path)
    with writing(path):
        target.parent.mkdir(parents=True, exist_ok=True)
        staging = new_file(target)
        try:
            yield staging
            if target.exists():
                shutil.copymode(target, staging)
            staging.replace(target)
        except BaseException:
            with suppress(OSError):
                staging.unlink(missing_ok=True)
            raise


def new_file(place: Path) -> Path:
    """A new, empty file next to `place`; raises `OSError`."""
    path = beside(place)
    os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    return path


def write_text(path: Path, text: str | Iterable[str]) -> None:
    """Writes a file, as a whole or piece by piece, that is complete or not there; raises as `replaced_file` does."""
    with replaced_file(path) as staging, staging.open("w", encoding="utf-8") as file:
        file.writelines([text] if isinstance(text, str) else text)
