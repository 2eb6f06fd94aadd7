"""`pdhocbf cache`: the compiled programs that are kept between commands."""

from __future__ import annotations

import argparse
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.arrays import read_arrays
from pdhocbf_drake.files.cache import LIMIT, VARIABLE, cache_files, cache_folder, throw_out
from pdhocbf_drake.terminal import table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Whether to empty it."""
    parser.add_argument("--clear", action="store_true", help="delete them; each is compiled again when it is needed")


def run(options: argparse.Namespace) -> int:
    """Prints the folder and its files, or deletes them; returns the exit code, 1 if some can't be deleted."""
    folder = cache_folder()
    if folder is None:
        print(f"there is no cache ({VARIABLE}=off, or no home folder)")
        return 0
    files = cache_files(folder)
    if options.clear:
        deleted = throw_out(folder, limit=-1)
        print(f"deleted {deleted} of {len(files)} files in {folder}")
        if deleted < len(files):
            raise InputError(f"{len(files) - deleted} files in {folder} can't be deleted")
        return 0
    size = sum(size for _, size in files)
    print(f"{folder}: {len(files)} walks, {_megabytes(size)} of at most {_megabytes(LIMIT)}")
    if files:
        print(table([(*_walk(path), _megabytes(size)) for path, size in files], ("walk", "last used", "size")))
    return 0


def _walk(path: Path) -> tuple[str, str]:
    """The first scenario with this walk, and when it was last used."""
    used = ""
    with suppress(OSError):
        used = f"{datetime.fromtimestamp(path.stat().st_mtime):%Y-%m-%d %H:%M}"
    arrays = read_arrays(path)
    return "damaged" if arrays is None else arrays.about.partition(" ")[0], used


def _megabytes(size: int) -> str:
    return f"{size / 2**20:.1f} MB"
