"""Rounded solids for the robot's shells: lofts through superellipses, superellipsoids and chamfered cylinders."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import trimesh

AROUND, ALONG = 28, 11  # vertices of a section, sections of a loft


class Section(NamedTuple):
    """A superellipse |x/a|ⁿ + |y/b|ⁿ = 1 at height z: half widths a, b, centre (x, y) [m], exponent n."""

    z: float
    a: float
    b: float
    x: float = 0.0
    y: float = 0.0


def loft(sections: Sequence[Section], n: float = 3.0, round_off: float = 0.35) -> trimesh.Trimesh:
    """A closed shell along z through the sections, bottom first.

    Args:
        sections: at least two, z increasing.
        n: exponent; 2 is an ellipse, large is a rectangle.
        round_off: how much of the end sections' size is turned over into a dome, 0 … 1.
    """
    table = np.array(sections)
    z = np.linspace(table[0, 0], table[-1, 0], ALONG)
    rows = np.column_stack([z, *(np.interp(z, table[:, 0], column) for column in table[:, 1:].T)])
    for _ in range(2):  # soften the corners of the linear interpolation
        rows[1:-1, 1:] = 0.25 * rows[:-2, 1:] + 0.5 * rows[1:-1, 1:] + 0.25 * rows[2:, 1:]
    bottom, top = _dome(rows[0], round_off, -1.0), _dome(rows[-1], round_off, 1.0)
    return _skin(np.vstack([bottom[::-1], rows, top]), n)


def ellipsoid(half: Sequence[float], centre: Sequence[float], n: float = 2.0) -> trimesh.Trimesh:
    """A superellipsoid with half axes (3,) [m]; n = 2 is an ellipsoid, 4 a pebble."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 15)[1:-1]
    wide, high = np.cos(angle) ** (2 / n), np.sign(np.sin(angle)) * abs(np.sin(angle)) ** (2 / n)
    rows = np.column_stack([high * half[2], wide * half[0], wide * half[1], 0 * angle, 0 * angle])
    return _skin(rows, n).apply_translation(centre)


def cylinder(
    radius: float, length: float, centre: Sequence[float], axis: str, chamfer: float = 0.006
) -> trimesh.Trimesh:
    """A cylinder along "x", "y" or "z" about its centre, its edges broken by a chamfer [m]."""
    h, r, c = length / 2, radius, min(chamfer, radius / 2, length / 3)
    profile = [
        (0, -h),
        (r - c, -h),
        (r - c, -h),
        (r, c - h),
        (r, c - h),
        (r, h - c),
        (r, h - c),
        (r - c, h),
        (r - c, h),
        (0, h),
    ]
    mesh = trimesh.creation.revolve(np.array(profile, dtype=float), sections=AROUND)
    turn = {"x": [0, np.pi / 2, 0], "y": [-np.pi / 2, 0, 0], "z": [0, 0, 0]}[axis]
    mesh.apply_transform(trimesh.transformations.euler_matrix(*turn))
    return mesh.apply_translation(centre)


def torus(ring: float, tube: float, centre: Sequence[float]) -> trimesh.Trimesh:
    """A ring about the x axis."""
    mesh = trimesh.creation.torus(ring, tube, major_sections=AROUND, minor_sections=8)
    mesh.apply_transform(trimesh.transformations.euler_matrix(0, np.pi / 2, 0))
    return mesh.apply_translation(centre)


def _dome(row: np.ndarray, share: float, sign: float) -> np.ndarray:
    """Sections that turn the end section over in a quarter of an ellipse."""
    angle = np.linspace(0, np.pi / 2, 5)[1:]
    depth = 0.5 * share * min(row[1], row[2])
    rows = np.tile(row, (len(angle), 1))
    rows[:, 0] += sign * depth * np.sin(angle)
    rows[:, 1:3] *= (1 - share * (1 - np.cos(angle)))[:, None]
    return rows


def _skin(rows: np.ndarray, n: float) -> trimesh.Trimesh:
    """Triangles between consecutive sections (z, a, b, x, y), and flat ends."""
    angle = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    unit = np.column_stack([np.cos(angle), np.sin(angle)])
    unit = np.sign(unit) * abs(unit) ** (2 / n)
    rings = np.concatenate(
        [np.column_stack([r[3] + r[1] * unit[:, 0], r[4] + r[2] * unit[:, 1], 0 * angle + r[0]]) for r in rows]
    )
    ends = np.array([[rows[i, 3], rows[i, 4], rows[i, 0]] for i in (0, -1)])
    here = np.arange(AROUND)
    there = np.roll(here, -1)
    faces = [np.column_stack([np.full(AROUND, len(rings)), there, here])]
    for k in range(len(rows) - 1):
        low, high = k * AROUND, (k + 1) * AROUND
        faces.append(np.column_stack([low + here, low + there, high + there]))
        faces.append(np.column_stack([low + here, high + there, high + here]))
    last = (len(rows) - 1) * AROUND
    faces.append(np.column_stack([last + here, last + there, np.full(AROUND, len(rings) + 1)]))
    return trimesh.Trimesh(np.vstack([rings, ends]), np.vstack(faces), process=False)
