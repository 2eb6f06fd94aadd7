"""Contact of the feet with the ground: four small spheres at the corners of each sole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pydrake.geometry import CollisionFilterDeclaration, GeometryId, GeometrySet, Role, SceneGraph, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import Frame

_RADIUS = 2.0 / 15.0  # of the spheres, as a share of the sole's shorter half side
_FRICTION = CoulombFriction(1.0, 1.0)  # the scenario's replaces it


def stand_on_spheres(plant: MultibodyPlant, scene_graph: SceneGraph, sole: Frame, half_size: Sequence[float]) -> None:
    """A foot touches the ground with four spheres, whose lowest points are the corners of its sole.

    They take the place of the contact geometry of the foot and of what is welded to it, and ignore what that ignored.

    Args:
        plant: not finalized; its geometry is in `scene_graph`.
        sole: the frame at the sole's centre, x forward, z up.
        half_size: half length and half width of the sole [m].
    """
    bodies = plant.GetBodiesWeldedTo(sole.body())
    old = [geometry for body in bodies for geometry in plant.GetCollisionGeometriesForBody(body)]
    ignored = list(_ignored(scene_graph, old))
    for geometry in old:
        scene_graph.RemoveRole(plant.get_source_id(), geometry, Role.kProximity)
    radius, new = beyond_sole(half_size), []
    for x, end in ((-1, "heel"), (1, "toe")):
        for y, edge in ((-1, "right"), (1, "left")):
            centre = sole.GetFixedPoseInBodyFrame() @ RigidTransform([x * half_size[0], y * half_size[1], radius])
            name = f"{sole.name()}_{end}_{edge}"
            new.append(plant.RegisterCollisionGeometry(sole.body(), centre, Sphere(radius), name, _FRICTION))
    if ignored:
        declaration = CollisionFilterDeclaration().ExcludeBetween(GeometrySet(new), GeometrySet(ignored))
        scene_graph.collision_filter_manager().Apply(declaration)


def beyond_sole(half_size: Sequence[float]) -> float:
    """How far the spheres reach beyond the edges of a sole: their radius [m]."""
    return _RADIUS * min(half_size)


def _ignored(scene_graph: SceneGraph, geometries: Sequence[GeometryId]) -> Iterator[GeometryId]:
    """Geometries, other than these, that one of them doesn't collide with."""
    inspector = scene_graph.model_inspector()
    for other in inspector.GetAllGeometryIds(Role.kProximity):
        if other not in geometries and any(inspector.CollisionFiltered(one, other) for one in geometries):
            yield other
