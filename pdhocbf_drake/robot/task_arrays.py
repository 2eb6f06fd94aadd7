"""Puts together the arrays of `task_space.TaskSpace` from what Drake gives, as machine code."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.jit import compiled

_SMALL_TURN = 2.99  # trace of a rotation matrix, 1 + 2 cos: above it the sine of the angle stands for the angle


@compiled
def write_error(rows: np.ndarray, offset: np.ndarray, places: np.ndarray, out: np.ndarray) -> bool:
    """The error, (18,), as `TargetPoses` has it; whether all three turns are small."""
    small = True
    for i in range(len(rows)):
        total = offset[i] if i < 18 else 0.0
        for j in range(len(places)):
            total += rows[i, j] * places[j]
        if i < 18:
            out[i] = total
        else:
            small = small and total >= _SMALL_TURN
    return small


@compiled
def write_places(com: np.ndarray, torso: np.ndarray, left: np.ndarray, right: np.ndarray, out: np.ndarray) -> None:
    """`TaskSpace.places`, (39,), of the CoM (3,) and three poses (3, 4)."""
    for i in range(3):
        out[i] = com[i]
        for j in range(4):
            out[3 + 4 * i + j] = torso[i, j]
            out[15 + 4 * i + j] = left[i, j]
            out[27 + 4 * i + j] = right[i, j]


@compiled
def write_jacobian(
    com: np.ndarray, torso: np.ndarray, left: np.ndarray, right: np.ndarray, out: np.ndarray, again: np.ndarray
) -> None:
    """`TaskSpace.jacobian`, (18, 18), twice, of the CoM's (3, 18) and of three frames' (6, 18), turns first."""
    for i in range(3):
        for j in range(18):
            out[i, j], out[3 + i, j] = com[i, j], torso[i, j]
            out[6 + i, j], out[9 + i, j] = left[3 + i, j], left[i, j]
            out[12 + i, j], out[15 + i, j] = right[3 + i, j], right[i, j]
    for i in range(18):
        for j in range(18):
            again[i, j] = out[i, j]


@compiled
def write_bias(
    force: np.ndarray, base: np.ndarray, mass: float, torso: np.ndarray, left: np.ndarray, right: np.ndarray,
    out: np.ndarray,
) -> None:  # fmt: skip
    """`TaskSpace.bias`, (18,), of the bias force C v (18,) and three frames' bias accelerations (6,), turns first."""
    for i in range(3):
        # With v̇ = 0 the force on the base is the whole robot's mass times its CoM's acceleration.
        out[i], out[3 + i] = force[base[3 + i]] / mass, torso[i]
        out[6 + i], out[9 + i] = left[3 + i], left[i]
        out[12 + i], out[15 + i] = right[3 + i], right[i]
