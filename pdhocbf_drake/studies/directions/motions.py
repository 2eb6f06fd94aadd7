"""A walk's log as it would be from another place and heading, or mirrored."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from pdhocbf_drake.analysis.heading import along
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.systems.signals import JOINTS


class Kinds(NamedTuple):
    """Columns of a signal: pairs (x, y) of places and of vectors, and headings; all others are the same anywhere."""

    places: tuple[tuple[int, int], ...] = ()
    vectors: tuple[tuple[int, int], ...] = ()
    headings: tuple[int, ...] = ()


WORLD: Final = {
    "lip_state": Kinds(places=((0, 3), (2, 5)), vectors=((1, 4),)),
    "com_reference": Kinds(places=((0, 3),), vectors=((1, 4), (2, 5))),
    "zmp_reference": Kinds(places=((0, 2),), vectors=((1, 3),)),
    "stance_plan": Kinds(places=((0, 1), (2, 3), (4, 5), (6, 7))),
    "foot_state": Kinds(places=((0, 1), (6, 7)), headings=(5, 11)),
}
"""Signals in the world's axes, without the feet's roll and pitch, which are those of a foot along its heading."""
BODY: Final = ("joint_state", "actuation", "com_z", "h")
"""Signals that are the same from anywhere."""


def moved(log: RunLog, name: str, place: tuple[float, float], yaw: float) -> np.ndarray:
    """A signal of `WORLD` of a walk from the origin, as it is from another place [m] and heading [rad]."""
    table, kinds = log[name].copy(), WORLD[name]
    turn = np.full(len(table), -yaw)
    for pair in (*kinds.places, *kinds.vectors):
        table[:, pair] = along(log[name][:, pair], turn)
    for pair in kinds.places:
        table[:, pair] += place
    table[:, list(kinds.headings)] += yaw
    return table


def mirrored(log: RunLog, name: str) -> np.ndarray:
    """A signal as it is in the walk with left and right exchanged, about the x axis."""
    table = log[name]
    if name in BODY:
        return table * 1.0 if name in ("com_z", "h") else _joints_exchanged(table)
    table, kinds = table.copy(), WORLD[name]
    for _, y in (*kinds.places, *kinds.vectors):
        table[:, y] *= -1.0
    if name == "foot_state":
        table[:, [3, 5, 9, 11]] *= -1.0
        table = table[:, [*range(6, 12), *range(6)]]
    return table


def _joints_exchanged(table: np.ndarray) -> np.ndarray:
    """Left and right joints exchanged; yaw and roll joints turn the other way."""
    half = len(JOINTS) // 2
    order = [*range(half, 2 * half), *range(half)]
    signs = np.array([-1.0 if joint.endswith(("yaw", "roll")) else 1.0 for joint in JOINTS])
    count = table.shape[1] // len(JOINTS)
    return np.concatenate([(block * signs)[:, order] for block in np.split(table, count, axis=1)], axis=1)


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """The largest difference of two tables, over the largest change of the first one along its run."""
    size = np.ptp(one, axis=0).max()
    return float(np.abs(one - other).max() / size) if size else float(np.abs(one - other).max())
