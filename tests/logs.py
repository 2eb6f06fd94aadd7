"""Comparison of logs."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.systems.signals import places


def differences(log: RunLog, other: RunLog) -> list[str]:
    """Names of the signals that differ in any bit; wall times are left out, since they differ in every run."""
    names = sorted({*log.signals, *other.signals})
    different = [name for name in names if not _same(_untimed(log, name), _untimed(other, name))]
    if not _same(log.time, other.time):
        different.insert(0, "time")
    return different + (["ending"] if log.ending != other.ending else [])


def _untimed(log: RunLog, name: str) -> np.ndarray | None:
    table = log.signals.get(name)
    return np.delete(table, places(name, "time"), axis=1) if name == "solver_status" and table is not None else table


def _same(a: np.ndarray | None, b: np.ndarray | None) -> bool:
    if a is None or b is None:
        return a is b
    return a.shape == b.shape and a.tobytes() == b.tobytes()
