"""A model as Drake reads it, with all joints at zero and its base at the origin."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
from pydrake.geometry import Role
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import Joint, PrismaticJoint, RevoluteJoint, RigidBody, WeldJoint
from pydrake.systems.framework import DiagramBuilder

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.robot.foot_points import surface_points
from pdhocbf_drake.robot.parsing import listed, refusals, warnings_once

_ROLES = (Role.kProximity, Role.kIllustration)
_PLAIN = RigidTransform()
_MOVING = {RevoluteJoint.kTypeName, PrismaticJoint.kTypeName}


class ParsedModel:
    """A finalized plant with scene graph that holds one model.

    Attributes:
        plant, scene_graph: of the model. context: the plant's, with all joints at zero.
        base: the floating body. bodies: of the model, in the plant's order.
        mass: total mass [kg].
    """

    def __init__(self, path: Path, name: str = "") -> None:
        """
        Args:
            path: of the model. name: by which messages call it; otherwise its path.

        Raises:
            ModelError: Drake refuses the model, it has no mass, or none or several of its bodies float.
        """
        builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlant(MultibodyPlantConfig(), builder)
        with refusals(name or str(path), path), warnings_once():
            (instance,) = Parser(self.plant).AddModels(path) or [None]
            self.plant.Finalize()
        self.bodies: list[RigidBody] = [self.plant.get_body(index) for index in self.plant.GetBodyIndices(instance)]
        self._joints: list[Joint] = [self.plant.get_joint(index) for index in self.plant.GetJointIndices(instance)]
        self._above = {joint.child_body().index(): joint for joint in self._joints}
        self.base = self._floating()
        self.diagram = builder.Build()
        self.root_context = self.diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root_context)
        positions = np.zeros(self.plant.num_positions())
        positions[self.base.floating_positions_start()] = 1.0
        self.plant.SetPositions(self.context, positions)
        self.mass = float(self.plant.CalcTotalMass(self.context))
        if not self.mass > 0.0:
            raise ModelError(f"{name or path} has no mass: its links need <inertial> tags")

    def _floating(self) -> RigidBody:
        floating = [self.plant.get_body(index) for index in sorted(self.plant.GetFloatingBaseBodies(), key=int)]
        if len(floating) == 1:
            return floating[0]
        if floating:
            names = listed(body.name() for body in floating)
            raise ModelError(f"the model has several floating links, which no joint connects: {names}; one is allowed")
        world = self.plant.world_body().index()
        fixed = [joint.child_body().name() for joint in self._joints if joint.parent_body().index() == world]
        raise ModelError(
            f"the base of the model is fixed to the world, and that of a walking robot floats: "
            f"give --base with the link that is to float; fixed is {listed(fixed) or 'all of it'}"
        )

    def chain(self, body: RigidBody) -> tuple[Joint, ...]:
        """The moving joints between the base and a body, from the base on."""
        chain = []
        while (joint := self._above.get(body.index())) is not None:
            if joint.type_name() in _MOVING:
                chain.append(joint)
            body = joint.parent_body()
        return tuple(reversed(chain))

    def moved_by(self, joint: Joint) -> list[RigidBody]:
        """The bodies that hang from a joint."""
        return [body for body in self.bodies if any(above.index() == joint.index() for above in self.chain(body))]

    @property
    def moving(self) -> list[Joint]:
        """The joints with one degree of freedom."""
        return [joint for joint in self._joints if joint.type_name() in _MOVING]

    @property
    def other(self) -> list[Joint]:
        """Joints that neither move along or about one axis nor are fixed, but for the base's own."""
        known = {*_MOVING, WeldJoint.kTypeName}
        base = self.base.index()
        return [j for j in self._joints if j.type_name() not in known and j.child_body().index() != base]

    @cached_property
    def groups(self) -> dict[tuple[int, ...], list[RigidBody]]:
        """Bodies that move as one, by the indices of the moving joints above them."""
        groups: dict[tuple[int, ...], list[RigidBody]] = {}
        for body in self.bodies:
            groups.setdefault(tuple(int(joint.index()) for joint in self.chain(body)), []).append(body)
        return groups

    def points(
        self, bodies: Iterable[RigidBody], roles: Sequence[Role] = _ROLES, level: RigidTransform = _PLAIN
    ) -> np.ndarray:
        """Points of the bodies' geometry in the world, of contact geometry or what is drawn or both, (n, 3) [m].

        Of a sphere they are the lowest ones along the z axis of `level`.
        """
        inspector, found = self.scene_graph.model_inspector(), [np.empty((0, 3))]
        for body in bodies:
            pose = self.plant.EvalBodyPoseInWorld(self.context, body)
            for role in roles:
                for geometry in inspector.GetGeometries(self.plant.GetBodyFrameIdOrThrow(body.index()), role):
                    shape = inspector.GetShape(geometry)
                    there = level.inverse() @ pose @ inspector.GetPoseInFrame(geometry)
                    found.append((level @ surface_points(shape, there).T).T)
        return np.vstack(found)

    def axis(self, joint: Joint) -> np.ndarray:
        """The unit vector along a moving joint's axis in the world (3,)."""
        own = joint.revolute_axis() if joint.type_name() == RevoluteJoint.kTypeName else joint.translation_axis()
        return np.array(joint.frame_on_parent().CalcPoseInWorld(self.context).rotation() @ own)

    def place(self, joint: Joint) -> np.ndarray:
        """A point on a joint's axis in the world (3,) [m]."""
        return np.array(joint.frame_on_child().CalcPoseInWorld(self.context).translation())
