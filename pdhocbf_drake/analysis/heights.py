"""Heights over the ground in a log, where the ground is not flat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.ground.terrain import Terrain
from pdhocbf_drake.simulation.run_log import RunLog

Array = NDArray[np.float64]


def commanded_com_height(log: RunLog) -> Array:
    """Commanded height of the CoM in the world, (T,) [m]: above the ground's line, on uneven ground of the map."""
    height: Array = log.element("com_height", "z")
    return height + log.element("ground_reference", "z") if "ground_reference" in log else height


def above_ground(places: Array, terrain: Terrain | None) -> Array:
    """Heights of places (…, 3) over the true ground under each of them, (…) [m]; over z = 0 without terrain."""
    if terrain is None or terrain.flat:
        return places[..., 2]
    ground = [terrain.height(x, y, known=False) for x, y, _ in places.reshape(-1, 3).tolist()]
    return np.asarray(places[..., 2] - np.reshape(ground, places.shape[:-1]))
