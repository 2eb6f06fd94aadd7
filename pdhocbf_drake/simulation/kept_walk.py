"""Compiled programs and nominal orbits of walks, kept on disk by what they are made from, one file a walk.

Programs are the same to the last bit whether they are read or compiled. Whatever is wrong with the file or its folder,
they are compiled.
"""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import pdhocbf_drake
from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.files.arrays import read_arrays, write_arrays
from pdhocbf_drake.files.cache import SUFFIX, cache_folder, mark_used, throw_out
from pdhocbf_drake.mpc.config import SENSING
from pdhocbf_drake.mpc.programs import ProgramCache
from pdhocbf_drake.simulation.scenario import Scenario

_PACKAGES: Final = ("drake", "daqp", "numba", "numpy")
_SOURCES: Final = ("barriers", "ground", "mpc", "qp", "simulation", "walking")  # rooms that decide what a program is
_THETA: Final = {"bound", "unit"}  # of a barrier: bounds are parameters of the programs


def kept_programs(scenario: Scenario) -> ProgramCache:
    """What earlier processes have kept for a scenario's walk; empty where that is nothing."""
    path = walk_file(scenario)
    arrays = None if path is None else read_arrays(path)
    if path is None or arrays is None or arrays.about.split()[-1:] != [path.stem]:  # a file under another one's name
        return ProgramCache()
    mark_used(path)
    return ProgramCache(arrays)


def keep_programs(scenario: Scenario, programs: ProgramCache) -> None:
    """Keeps what a scenario's walk has had to make, and throws out what was used longest ago."""
    path, new = walk_file(scenario), programs.new()
    if path is None or not new:
        return
    with suppress(PdhocbfError, OSError):  # a full disk, a folder that can't be written
        write_arrays(path, {**programs.kept, **new}, f"{scenario.name} {path.stem}")
        throw_out(path.parent)


def is_kept(scenario: Scenario) -> bool:
    """Whether there are programs of a scenario's walk."""
    return bool(kept_programs(scenario).kept)


def walk_file(scenario: Scenario) -> Path | None:
    """The file of a scenario's walk; None if there is to be none."""
    folder = cache_folder()
    if folder is None:
        return None
    barriers = {name: barrier.model_dump(exclude=_THETA) for name, barrier in scenario.barriers.items()}
    try:
        terminal = scenario.mpc.terminal_set and Path(scenario.mpc.terminal_set).read_bytes().hex()
        ground = [piece.model_dump() for piece in scenario.ground if piece.known]
        walk = [scenario.gait.model_dump(), scenario.mpc.model_dump(exclude=set(SENSING)), barriers, terminal, ground]
        key = [walk, made_by()]
    except OSError:
        return None
    return folder / f"{hashlib.sha256(json.dumps(key).encode()).hexdigest()[:32]}{SUFFIX}"


@cache
def made_by() -> list[Any]:
    """What decides the numbers besides the scenario: versions, this package's own source, and the processor."""
    package = Path(pdhocbf_drake.__file__).parent
    source = hashlib.sha256()
    for room in _SOURCES:
        for path in sorted((package / room).rglob("*.py")):
            source.update(path.read_bytes())
    versions = [sys.version, *map(_version, _PACKAGES), pdhocbf_drake.__version__]
    return [*versions, source.hexdigest(), platform.machine(), _processor()]


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def _processor() -> str:
    """The first processor's model, since BLAS chooses its loops by it."""
    with suppress(OSError), open("/proc/cpuinfo", encoding="utf-8", errors="replace") as stream:
        return next((line for line in stream.read(4096).splitlines() if line.startswith("model name")), "")
    return ""
