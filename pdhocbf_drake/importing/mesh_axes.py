"""Axes of mesh files: which of them is up."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

_UP = re.compile(r"<up_axis>\s*([XYZ])_UP")
Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""The transform of axes with y up to those with z up."""
_X_UP = np.array([[0.0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]])


def to_z_up(source: Path) -> np.ndarray:
    """The transform (4, 4) of a file's axes to those with z up: glTF's y is up, and COLLADA's where it says so."""
    if source.suffix.lower() in (".gltf", ".glb"):
        return Y_UP
    return named_turn(source)


def named_turn(source: Path) -> np.ndarray:
    """That of a COLLADA file which names its up axis; the unit matrix for all others."""
    if source.suffix.lower() == ".dae":
        with source.open(encoding="utf-8", errors="replace") as file:
            found = _UP.search(file.read(100_000))
        if found:
            return {"Y": Y_UP, "X": _X_UP, "Z": np.eye(4)}[found[1]]
    return np.eye(4)
