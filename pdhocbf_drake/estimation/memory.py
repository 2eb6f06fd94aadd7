"""What the estimator carries from tick to tick, in one vector with named parts."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from pdhocbf_drake.estimation.kernels import ERRORS, ESTIMATE

_PARTS: Final[dict[str, tuple[int, ...]]] = {
    "started": (1,), "estimate": (ESTIMATE,), "turns": (2, 9), "loaded": (2,), "standing": (2,), "above": (2,),
    "anchor": (5,), "zmp": (2,), "imu": (9,), "joints": (12,), "gap": (12,), "moved": (12,), "force_torque": (12,),
    "repeats": (4,), "changes": (2,), "ground": (2, 3), "covariance": (ERRORS, ERRORS),
}  # fmt: skip
_ENDS: Final = np.cumsum([math.prod(shape) for shape in _PARTS.values()]).tolist()
_PLACES: Final = [
    (name, slice(end - math.prod(shape), end), shape) for (name, shape), end in zip(_PARTS.items(), _ENDS, strict=True)
]
SIZE: Final[int] = _ENDS[-1]


class Memory:
    """Views of a vector (`SIZE`,), which is the estimator's whole state.

    Attributes:
        vector: all of it.
        started: 1 after the first tick (1,).
        estimate: of the base, its soles and biases, see `kernels` (27,). covariance: of its errors (33, 33).
        turns: the soles' rotations in the base at the last tick (2, 9).
        loaded: whether each foot carries load (2,). standing: whether it also stands still (2,). above: for how many
            ticks in a row it has carried load (2,).
        anchor: the foot whose place is held, 0 left or 1 right, its place, and what is added to the estimate (5,).
        zmp: last one, handed on (2,).
        imu, force_torque: of the last tick (9,), (12,). joints: angles of the last tick (12,).
        gap: angle less target when the encoder last changed (12,). moved: target at that time (12,).
        repeats: ticks in a row in which gyroscope, accelerometer, left and right force sensor said the same (4,).
        changes: decaying number of changes of each foot's load (2,).
        ground: under each foot, x and y of its normal and its height, see `met_ground.meet` (2, 3); NaN under a foot
            that has not come to it.
    """

    started: np.ndarray
    estimate: np.ndarray
    turns: np.ndarray
    loaded: np.ndarray
    standing: np.ndarray
    above: np.ndarray
    anchor: np.ndarray
    zmp: np.ndarray
    imu: np.ndarray
    joints: np.ndarray
    gap: np.ndarray
    moved: np.ndarray
    force_torque: np.ndarray
    repeats: np.ndarray
    changes: np.ndarray
    ground: np.ndarray
    covariance: np.ndarray

    def __init__(self, vector: np.ndarray | None = None) -> None:
        """A copy of the vector, or the memory before the first tick."""
        self.vector = np.zeros(SIZE) if vector is None else np.array(vector, dtype=float)
        for name, place, shape in _PLACES:
            setattr(self, name, self.vector[place].reshape(shape))
