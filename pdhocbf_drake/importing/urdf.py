"""The safe copy of a URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.importing.copying import Copying
from pdhocbf_drake.importing.inertia import lift_entries
from pdhocbf_drake.robot.model_text import drake_tag, number

_KEPT = {"link", "joint", "transmission", drake_tag("collision_filter_group")}


def copy_urdf(root: ET.Element, copying: Copying) -> None:
    """Rewrites the tree in place; raises `InputError` for a xacro file."""
    if any("xacro" in element.tag for element in root.iter()):
        raise InputError(f"{copying.source} is a xacro file; make a URDF of it with `xacro FILE > robot.urdf`")
    _inline_colours(root)
    for element in list(root):
        if element.tag not in _KEPT or (element.tag == "transmission" and not _is_simple(element)):
            root.remove(element)
    _free_base(root, copying)
    _drop_mimics(root, copying)
    _lift_inertias(root, copying)
    frictions = [number(dynamics.attrib.pop("friction", None)) for dynamics in root.findall("joint/dynamics")]
    if any(frictions):
        copying.changes.append("joint friction left out, which Drake does not have")
    for link in root.findall("link"):
        for role in ("visual", "collision"):
            for shape in link.findall(role):
                mesh = shape.find("geometry/mesh")
                if mesh is None:
                    continue
                name = copying.mesh(mesh.get("filename", ""), role == "collision")
                if name is None:
                    link.remove(shape)
                else:
                    mesh.set("filename", name)


def _inline_colours(root: ET.Element) -> None:
    """Gives each visual its colour: names may be defined twice, which Drake refuses, or not at all."""
    named: dict[str, str] = {}
    for material in root.iter("material"):
        colour = material.find("color")
        if colour is not None:
            named.setdefault(material.get("name", ""), colour.get("rgba", ""))
    for visual in root.iter("visual"):
        for material in visual.findall("material"):
            own = material.find("color")
            rgba = named.get(material.get("name", "")) if own is None else own.get("rgba")
            visual.remove(material)
            if rgba:
                coloured = ET.SubElement(visual, "material", name=f"rgba {rgba}")
                ET.SubElement(coloured, "color", rgba=rgba)


def _is_simple(transmission: ET.Element) -> bool:
    """Whether Drake reads it, and it says more than a joint's own limit."""
    kind = (transmission.findtext("type") or transmission.get("type") or "").rpartition("/")[2]
    own = [element for element in transmission.iter() if element.tag.startswith(drake_tag(""))]
    return kind == "SimpleTransmission" and bool(own)


def _free_base(root: ET.Element, copying: Copying) -> None:
    """Drops a link `world` that carries the robot by a floating joint, and what fixes the base that is to float."""
    children = {
        child.get("link"): joint for joint in root.findall("joint") if (child := joint.find("child")) is not None
    }
    for link, joint in children.items():
        parent = joint.find("parent")
        floating = joint.get("type") == "floating" and parent is not None and parent.get("link") not in children
        if floating or link == copying.base:
            root.remove(joint)
            name = None if parent is None else parent.get("link")
            _drop_above(root, name, children)
            copying.changes.append(f"joint {joint.get('name')} removed, so that {link} floats")


def _drop_above(root: ET.Element, name: str | None, children: dict[str | None, ET.Element]) -> None:
    """Removes a link that now carries nothing, and those that it hangs from."""
    carries = {parent.get("link") for joint in root.findall("joint") if (parent := joint.find("parent")) is not None}
    for link in root.findall("link"):
        if link.get("name") == name and name not in carries:
            root.remove(link)
            if (joint := children.get(name)) is not None and joint in list(root):
                root.remove(joint)
                parent = joint.find("parent")
                _drop_above(root, None if parent is None else parent.get("link"), children)


def _drop_mimics(root: ET.Element, copying: Copying) -> None:
    followers = []
    for joint in root.findall("joint"):
        if (mimic := joint.find("mimic")) is not None:
            joint.remove(mimic)
            followers.append(joint.get("name", ""))
    copying.note(followers, "joints no longer follow others (mimic)")


def _lift_inertias(root: ET.Element, copying: Copying) -> None:
    changed = []
    for link in root.findall("link"):
        inertial = link.find("inertial")
        inertia = None if inertial is None else inertial.find("inertia")
        if inertial is None or inertia is None:
            continue
        mass_tag = inertial.find("mass")
        mass = (0.0 if mass_tag is None else number(mass_tag.get("value"))) or 0.0
        if mass <= 0.0:
            link.remove(inertial)
            continue
        if lift_entries(mass, inertia.get, inertia.set):
            changed.append(link.get("name", ""))
    copying.note(changed, "inertias that no body can have raised")
