"""Inertias that no body can have, lifted to the nearest possible ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pdhocbf_drake.robot.model_text import number

_ENTRIES = (("ixx", 0, 0), ("iyy", 1, 1), ("izz", 2, 2), ("ixy", 0, 1), ("ixz", 0, 2), ("iyz", 1, 2))
_MARGIN = 1e-3  # by which the triangle inequality is kept, as a share of the largest principal moment
_RADIUS = 0.005  # radius of gyration of a body whose inertia is zero or negative [m]


def lifted(mass: float, inertia: np.ndarray) -> np.ndarray | None:
    """The rotational inertia (3, 3) about the centre of mass with its small principal moments raised [kg m²].

    Moments a ≤ b ≤ c of a body are positive, with c ≤ a + b. Returns None where they are so already.
    """
    moments, axes = np.linalg.eigh(0.5 * (inertia + inertia.T))
    if moments[0] > 0.0 and moments[2] <= moments[0] + moments[1]:
        return None
    moments = np.maximum(moments, 0.4 * mass * _RADIUS**2)
    lacking = moments[2] * (1.0 + _MARGIN) - moments[0] - moments[1]
    if lacking > 0.0:
        moments[:2] += lacking / 2.0
    return np.asarray(axes * moments @ axes.T)


def lift_entries(mass: float, read: Callable[[str], str | None], write: Callable[[str, str], None]) -> bool:
    """Reads the entries ixx … iyz of an inertia, and writes them where `lifted` changes them; returns whether."""
    matrix = np.zeros((3, 3))
    for name, row, column in _ENTRIES:
        matrix[row, column] = matrix[column, row] = number(read(name)) or 0.0
    better = lifted(mass, matrix)
    if better is None:
        return False
    for name, row, column in _ENTRIES:
        write(name, f"{better[row, column]:.9g}")
    return True
