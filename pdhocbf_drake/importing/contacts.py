"""Which bodies of a model ignore each other: a leg's own and the rest of the body, and what overlaps at zero."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from itertools import combinations, count

from pydrake.multibody.tree import RigidBody

from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.importing.roles import Leg
from pdhocbf_drake.robot.model_text import drake_tag

Pair = tuple[str, str]


def ignoring_groups(model: ParsedModel, legs: tuple[Leg, Leg]) -> list[list[str]]:
    """Names of bodies that are to ignore each other: all but those of the right leg, and all but those of the left."""
    groups = []
    for other in legs:
        hip = other.limb.joints[0].index()
        bodies = (body for body in model.bodies if all(joint.index() != hip for joint in model.chain(body)))
        groups.append([body.name() for body in bodies if _collides(model, body)])
    return [group for group in groups if len(group) > 1]


def overlaps(model: ParsedModel, legs: tuple[Leg, Leg]) -> list[Pair]:
    """Pairs of bodies of different legs that overlap with all joints at zero."""
    query = model.scene_graph.get_query_output_port().Eval(
        model.scene_graph.GetMyContextFromRoot(model.root_context)
    )  # its poses are those of `model.context`
    sides = [{int(joint.index()) for joint in leg.limb.joints} for leg in legs]
    found = set()
    for pair in query.ComputePointPairPenetration():
        names = []
        for geometry in (pair.id_A, pair.id_B):
            body = model.plant.GetBodyFromFrameId(query.inspector().GetFrameId(geometry))
            chain = {int(joint.index()) for joint in model.chain(body)}
            names.append((next((side for side, own in enumerate(sides) if chain & own), None), body.name()))
        (one, first), (other, second) = names
        if one is not None and other is not None and one != other:
            found.add((min(first, second), max(first, second)))
    return sorted(found)


def _collides(model: ParsedModel, body: RigidBody) -> bool:
    return bool(model.plant.GetCollisionGeometriesForBody(body))


def ignore(root: ET.Element, groups: list[list[str]]) -> None:
    """Writes into the tree of a model that the bodies of each group ignore each other."""
    if root.tag == "mujoco":
        contact = root.find("contact")
        contact = ET.SubElement(root, "contact") if contact is None else contact
        there = {frozenset((e.get("body1"), e.get("body2"))) for e in contact.findall("exclude")}
        for first, second in sorted({pair for group in groups for pair in combinations(sorted(group), 2)}):
            if frozenset((first, second)) not in there:
                ET.SubElement(contact, "exclude", body1=first, body2=second)
        return
    parent = root if root.tag == "robot" else root.find("model")
    tag = drake_tag("collision_filter_group")
    taken = {element.get("name") for element in root.iter(tag)}
    free = (name for number in count(1) if (name := f"ignoring_{number}") not in taken)
    for name, group in zip(free, groups, strict=False):
        element = ET.SubElement(parent if parent is not None else root, tag, name=name)
        for body in group:
            member = ET.SubElement(element, drake_tag("member"))
            if root.tag == "robot":
                member.set("link", body)
            else:
                member.text = body
        ignored = ET.SubElement(element, drake_tag("ignored_collision_filter_group"))
        if root.tag == "robot":
            ignored.set("name", name)
        else:
            ignored.text = name
