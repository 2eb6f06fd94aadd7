"""Heights over the ground in a log, where the ground is not flat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.ground.terrain import Terrain
from pdhocbf_drake.simulation.run_log import RunLog

Array = NDArray[np.float64]


def commanded_com_height(log: RunLog) -> Array:
    """Commanded height of the CoM in the world, (T,) [m]: above the ground's line, where the ground is uneven."""
    height: Array = log.element("com_height", "z")
    return height + _of_ground(log, "z")


def zmp_height(log: RunLog) -> Array:
    """Height of the plane in which the ZMP is, in the world, (T,) [m]."""
    return _of_ground(log, "z_zmp") + np.zeros(len(log))


def _of_ground(log: RunLog, element: str) -> Array | float:
    """As planned and, where the feet feel the ground, as they have met it; 0 on level ground."""
    names = (name for name in ("ground_target", "ground_reference") if name in log)
    name = next(names, None)
    return 0.0 if name is None else log.element(name, element)


def above_ground(places: Array, terrain: Terrain | None) -> Array:
    """Heights of places (…, 3) over the true ground under each of them, (…) [m]; over z = 0 without terrain."""
    if terrain is None or terrain.flat:
        return places[..., 2]
    ground = [terrain.height(x, y, known=False) for x, y, _ in places.reshape(-1, 3).tolist()]
    return np.asarray(places[..., 2] - np.reshape(ground, places.shape[:-1]))
