"""Triangles of what is drawn of a robot, for a picture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydrake.geometry import Mesh, Role, SceneGraph, Shape
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.systems.framework import Context, DiagramBuilder
from scipy.spatial import ConvexHull, QhullError

from pdhocbf_drake.importing.meshes import triangles_of
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.foot_points import surface_points


class Pictured(NamedTuple):
    """A robot in a posture.

    Attributes:
        plant: with the robot alone. context: its, in the posture.
        triangles: in the world (n, 3, 3) [m]. bodies: names of the bodies that they belong to.
    """

    plant: MultibodyPlant
    context: Context
    triangles: np.ndarray
    bodies: list[str]


def pictured(biped: Biped, q: np.ndarray) -> Pictured:
    """What is drawn of the robot at q (19,); where nothing is, its contact geometry."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(MultibodyPlantConfig(), builder)
    biped.add_to(plant)
    plant.Finalize()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(root)
    plant.SetPositions(context, q)
    for role in (Role.kIllustration, Role.kProximity):
        triangles, bodies = _triangles(plant, scene_graph, context, role)
        if len(triangles):
            break
    return Pictured(plant, context, triangles, bodies)


def _triangles(
    plant: MultibodyPlant, scene_graph: SceneGraph, context: Context, role: Role
) -> tuple[np.ndarray, list[str]]:
    inspector, found, names = scene_graph.model_inspector(), [np.empty((0, 3, 3))], list[str]()
    for body in map(plant.get_body, plant.GetBodyIndices(plant.GetModelInstanceByName(_instance(plant)))):
        pose = plant.EvalBodyPoseInWorld(context, body)
        for geometry in inspector.GetGeometries(plant.GetBodyFrameIdOrThrow(body.index()), role):
            own = _of_shape(inspector.GetShape(geometry), pose @ inspector.GetPoseInFrame(geometry))
            found.append(own)
            names += [body.name()] * len(own)
    return np.vstack(found), names


def _instance(plant: MultibodyPlant) -> str:
    (base,) = plant.GetFloatingBaseBodies()
    return str(plant.GetModelInstanceName(plant.get_body(base).model_instance()))


def _of_shape(shape: Shape, pose: RigidTransform) -> np.ndarray:
    """Triangles (n, 3, 3) of a mesh, or of a shape's convex hull."""
    if isinstance(shape, Mesh) and shape.source().is_path():
        own = triangles_of(shape.source().path())
        if len(own):
            corners = own.reshape(-1, 3) * shape.scale3()
            return np.asarray((pose @ corners.T).T.reshape(-1, 3, 3))
    points = surface_points(shape, pose, exact=True)
    try:
        return np.asarray(points[ConvexHull(points).simplices])
    except (QhullError, ValueError):
        return np.empty((0, 3, 3))
