"""The ground as bodies of a plant: convex boxes under the surfaces of a terrain."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from pydrake.geometry import Box
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant

from pdhocbf_drake.ground.surfaces import FAR, Surface
from pdhocbf_drake.ground.terrain import Terrain

_FLAT = Box(2.0 * FAR, 2.0 * FAR, 2.0)  # Drake warns of a half space at every start
_DEPTH = 1.0  # [m]: of the boxes below the lowest surface
_SHOWN = 5.0  # [m]: how far the ground is drawn beyond its pieces
_COLOURS = np.array([[0.84, 0.86, 0.88, 1.0], [0.74, 0.77, 0.80, 1.0]])


class Slab(NamedTuple):
    """A box under a surface: its size [m] and its pose in the world."""

    box: Box
    pose: RigidTransform
    surface: Surface


def add_ground(plant: MultibodyPlant, terrain: Terrain, friction: float) -> None:
    """Adds the ground to a plant that is not finalized; where it is flat, as one box.

    Args:
        friction: of soles on ground without a friction of its own, and of the soles' geometry [1].
    """
    world, usual = plant.world_body(), CoulombFriction(friction, friction)
    if terrain.flat:
        below = RigidTransform([0.0, 0.0, -_FLAT.height() / 2.0])
        plant.RegisterCollisionGeometry(world, below, _FLAT, "ground", usual)
        return
    for index, slab in enumerate(slabs(terrain)):
        own = slab.surface.friction
        with_sole = usual if own is None else CoulombFriction(*[against(own, friction)] * 2)
        plant.RegisterCollisionGeometry(world, slab.pose, slab.box, f"ground_{index}", with_sole)
    for index, slab in enumerate(shown(terrain)):
        plant.RegisterVisualGeometry(world, slab.pose, slab.box, f"ground_{index}", _COLOURS[index % 2])


def against(wanted: float, other: float) -> float:
    """The friction of a body that, with that of another one, gives the wanted one: Drake takes 2 μ₁ μ₂/(μ₁ + μ₂)."""
    return wanted * other / (2.0 * other - wanted)


def slabs(terrain: Terrain) -> Iterator[Slab]:
    """A box under each surface. All go down to the same depth, or as deep along the normal of one that is inclined."""
    bottom = min(surface.z for surface in terrain.surfaces) - _DEPTH
    return (_slab(surface, bottom) for surface in terrain.surfaces)


def shown(terrain: Terrain) -> Iterator[Slab]:
    """Thin boxes to draw, near the pieces alone."""
    spans = [piece.span() for piece in terrain.pieces]
    low, high = spans[0][0] - _SHOWN, max(end for _, end in spans) + _SHOWN
    bottom = min(surface.z for surface in terrain.surfaces) - 0.1
    for s in terrain.surfaces:
        middle = 0.5 * (s.y0 + s.y1)
        wide = s.y1 - s.y0 > _SHOWN
        cut = s._replace(x0=max(s.x0, low), x1=min(s.x1, high))
        if wide:
            cut = cut._replace(y0=middle - 0.5 * _SHOWN, y1=middle + 0.5 * _SHOWN)
        if cut.x1 > cut.x0:
            yield _slab(cut._replace(z=s.height(cut.x0, middle)), bottom)


def _slab(surface: Surface, bottom: float) -> Slab:
    """The box whose top is a surface, with edges at its x0 and x1.

    One that is inclined along both has its y along the edges (0, 1, dz/dy), so that these are straight across.
    """
    along, across = surface.along, surface.across
    length, width = surface.x1 - surface.x0, surface.y1 - surface.y0
    sideways = np.array([0.0, 1.0, across]) / np.hypot(1.0, across)
    normal = np.array([-along, -across, 1.0]) / np.sqrt(1.0 + along**2 + across**2)
    ahead = np.cross(sideways, normal)
    turn = RotationMatrix(np.column_stack([ahead, sideways, normal]))
    middle_x, middle_y = 0.5 * (surface.x0 + surface.x1), 0.5 * (surface.y0 + surface.y1)
    top = np.array([middle_x, middle_y, surface.height(middle_x, middle_y)])
    thick = surface.z - bottom
    return Slab(
        Box(length / ahead[0], width / sideways[1], thick), RigidTransform(turn, top - 0.5 * thick * normal), surface
    )
