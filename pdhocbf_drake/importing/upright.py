"""Whether the up axis that COLLADA files name counts: many readers pass over it, and so do many robots' files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pydrake.geometry import Mesh, Role
from pydrake.math import RigidTransform
from pydrake.multibody.tree import RigidBody

from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.robot.foot_points import surface_points

_CLEARLY = 0.8  # share of the misfit below which meshes without their files' axes fit better


def fit_better_as_stored(model: ParsedModel, turns: Mapping[str, np.ndarray]) -> bool:
    """Whether meshes reach to the joints of their bodies better as they are stored than turned as their files say.

    Args:
        model: with the meshes turned.
        turns: the rotation from a file's axes to those with z up (3, 3), by the names of the meshes in question.
    """
    turned, stored = 0.0, 0.0
    inspector = model.scene_graph.model_inspector()
    for body in model.bodies:
        frame = model.plant.GetBodyFrameIdOrThrow(body.index())
        for geometry in inspector.GetGeometries(frame, Role.kIllustration):
            shape, pose = inspector.GetShape(geometry), inspector.GetPoseInFrame(geometry)
            turn = turns.get(Path(shape.source().description()).name) if isinstance(shape, Mesh) else None
            joints = _joints(model, body, pose)
            if turn is not None and len(joints) > 1:
                points = surface_points(shape, RigidTransform())
                turned += _misfit(points, joints)
                stored += _misfit(points / shape.scale3() @ turn * shape.scale3(), joints)
    return stored < _CLEARLY * turned


def _joints(model: ParsedModel, body: RigidBody, pose: RigidTransform) -> np.ndarray:
    """Places of a body's moving joints, seen in a frame that has that pose in the body (n, 3) [m]."""
    there = (model.plant.EvalBodyPoseInWorld(model.context, body) @ pose).inverse()
    ends = ((joint, joint.parent_body().index(), joint.child_body().index()) for joint in model.moving)
    return np.array([there @ model.place(joint) for joint, *bodies in ends if body.index() in bodies])


def _misfit(points: np.ndarray, joints: np.ndarray) -> float:
    """Sum of the joints' distances from the box around the points [m]."""
    outside = np.maximum(np.maximum(points.min(axis=0) - joints, joints - points.max(axis=0)), 0.0)
    return float(np.linalg.norm(outside, axis=1).sum())
