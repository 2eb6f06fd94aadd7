"""Points of a foot's geometry, from which its sole is found and checked."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Mesh, Role, SceneGraph, Shape, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, RigidBody, WeldJoint

_LAYER = 0.02  # thickness of the lowest layer, which touches the ground, as a share of the foot's length
_AROUND = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)


def foot_points(plant: MultibodyPlant, scene_graph: SceneGraph, frame: Frame) -> tuple[np.ndarray, str]:
    """Points on the surface of a foot and of what is welded to it, in a frame of the foot with z up, (n, 3) [m].

    Those of its contact geometry, or where it has none of what is drawn; the second value says which.
    """
    poses = _welded_poses(plant, frame.body())
    body_to_frame = frame.GetFixedPoseInBodyFrame().inverse()
    inspector = scene_graph.model_inspector()
    for role, what in ((Role.kProximity, "contact geometry"), (Role.kIllustration, "visual geometry")):
        contact = role == Role.kProximity
        points = []
        for body, pose in poses:
            owned = plant.GetCollisionGeometriesForBody(body) if contact else plant.GetVisualGeometriesForBody(body)
            for geometry in owned:
                there = body_to_frame @ pose @ inspector.GetPoseInFrame(geometry)
                points.append(surface_points(inspector.GetShape(geometry), there))
        if points:
            return np.vstack(points), what
    return np.empty((0, 3)), "no geometry"


def ground_layer(points: np.ndarray) -> np.ndarray:
    """Those of the points (n, 3), z up, that are lowest: they touch flat ground, or nearly so."""
    length = np.ptp(points[:, :2], axis=0).max()
    return points[points[:, 2] <= points[:, 2].min() + _LAYER * length]


def surface_points(shape: Shape, pose: RigidTransform, exact: bool = False) -> np.ndarray:
    """Corners of a shape, seen in a frame, (n, 3) [m]; of a sphere or capsule the lowest points along the frame's z.

    With `exact` these are round too.
    """
    if isinstance(shape, (Sphere, Capsule)) and not exact:
        half = shape.length() / 2.0 if isinstance(shape, Capsule) else 0.0
        ends = pose @ np.array([[0.0, 0.0, half], [0.0, 0.0, -half]]).T
        return np.unique(ends.T - [0.0, 0.0, shape.radius()], axis=0)
    return (pose @ _corners(shape).T).T


def _corners(shape: Shape) -> np.ndarray:
    """Points of a shape in its own frame (n, 3)."""
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    circle = np.column_stack([np.cos(_AROUND), np.sin(_AROUND)])
    if isinstance(shape, Box):
        return signs * np.array(shape.size()) / 2.0
    if isinstance(shape, Cylinder):
        return np.vstack([np.column_stack([shape.radius() * circle, np.full(len(circle), end * shape.length() / 2.0)])
                          for end in (-1, 1)])  # fmt: skip
    heights = np.linspace(-1.0, 1.0, 9)
    ball = np.vstack([np.column_stack([circle * np.sqrt(1.0 - z**2), np.full(len(circle), z)]) for z in heights])
    if isinstance(shape, Ellipsoid):
        return ball * [shape.a(), shape.b(), shape.c()]
    if isinstance(shape, Sphere):
        return ball * shape.radius()
    if isinstance(shape, Capsule):
        half = [0.0, 0.0, shape.length() / 2.0]
        return np.vstack([ball * shape.radius() + half, ball * shape.radius() - half])
    if isinstance(shape, (Mesh, Convex)):
        hull = shape.GetConvexHull()
        return np.array([hull.vertex(index) for index in range(hull.num_vertices())])
    return np.empty((0, 3))


def _welded_poses(plant: MultibodyPlant, body: RigidBody) -> list[tuple[RigidBody, RigidTransform]]:
    """A body and those welded to it, each with its pose in the first one; the plant need not be finalized."""
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    welds = [joint for joint in joints if joint.type_name() == WeldJoint.kTypeName]
    found = {body.index(): (body, RigidTransform())}
    waiting = [body]
    while waiting:
        present = waiting.pop()
        for weld in welds:
            child, parent = weld.child_body(), weld.parent_body()
            across = (
                weld.frame_on_parent().GetFixedPoseInBodyFrame()
                @ weld.X_FM()
                @ (weld.frame_on_child().GetFixedPoseInBodyFrame().inverse())
            )  # of the child in the parent
            for one, other, step in ((parent, child, across), (child, parent, across.inverse())):
                if one.index() == present.index() and other.index() not in found:
                    found[other.index()] = (other, found[one.index()][1] @ step)
                    waiting.append(other)
    return list(found.values())
