"""Provenance of a run: versions, commit, seed, machine and time."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
import sys
from datetime import datetime, timezone
from functools import cache
from pathlib import Path

import pdhocbf_drake
from pdhocbf_drake.config import Config
from pdhocbf_drake.simulation.scenario import Scenario

_PACKAGES = ("drake", "daqp", "numpy", "pydantic", "matplotlib")


class Provenance(Config):
    """Versions, seed and machine of a run, for its repetition.

    Attributes:
        pdhocbf_drake: version of this package.
        commit, modified: commit of the package's checkout, and whether it had uncommitted changes; null for an
            installed package.
        python, packages: versions of Python and of the packages that determine the numbers.
        machine, processor, cores: the computer, on which wall times depend.
        seed: seed of all random numbers.
        started: date and time, UTC.
        wall_seconds: wall time of the simulation [s].
    """

    pdhocbf_drake: str
    commit: str | None
    modified: bool | None
    python: str
    packages: dict[str, str]
    machine: str
    processor: str
    cores: int
    seed: int
    started: str
    wall_seconds: float

    @classmethod
    def of_run(cls, scenario: Scenario, started: datetime, wall_seconds: float) -> Provenance:
        """The provenance of a run that this process has simulated."""
        commit, modified = _commit(Path(pdhocbf_drake.__file__).resolve().parent)
        return cls(
            pdhocbf_drake=pdhocbf_drake.__version__,
            commit=commit,
            modified=modified,
            python=sys.version.split()[0],
            packages={name: importlib.metadata.version(name) for name in _PACKAGES},
            machine=platform.platform(),
            processor=_processor(),
            cores=os.cpu_count() or 1,
            seed=scenario.seed,
            started=started.astimezone(timezone.utc).isoformat(timespec="seconds"),
            wall_seconds=wall_seconds,
        )


@cache
def _commit(package: Path) -> tuple[str | None, bool | None]:
    """Commit and modified state of this package's checkout, not of a repository around its environment."""
    checkout = package.parent
    if not (checkout / ".git").exists() or not (checkout / "pyproject.toml").is_file():
        return None, None
    commit = _git(checkout, "rev-parse", "HEAD")
    status = _git(checkout, "status", "--porcelain", "--untracked-files=no")
    return commit, None if status is None else bool(status)


def _git(folder: Path, *words: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *words], capture_output=True, text=True, timeout=10, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
