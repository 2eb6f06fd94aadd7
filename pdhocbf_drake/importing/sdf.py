"""The safe copy of an SDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from functools import partial

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.importing.copying import Copying
from pdhocbf_drake.importing.inertia import lift_entries
from pdhocbf_drake.robot.model_text import number

_DROPPED = {"plugin", "sensor", "light", "audio_source", "particle_emitter"}


def copy_sdf(root: ET.Element, copying: Copying) -> None:
    """Rewrites the tree in place; raises `InputError` for a file with several models, or one that includes others."""
    models = [*root.findall("model"), *root.findall("world/model")]
    if len(models) != 1:
        raise InputError(f"{copying.source} holds {len(models)} models, one is needed")
    model = models[0]
    root[:] = [model]
    if model.find("include") is not None:
        raise InputError(f"{copying.source} includes other files; write one of it with `gz sdf -p FILE > robot.sdf`")
    for parent in list(model.iter()):
        for element in [child for child in parent if child.tag in _DROPPED]:
            parent.remove(element)
    _free_base(model, copying)
    followers, lifted = [], []
    for joint in model.findall("joint"):
        axis = joint.find("axis")
        mimic = None if axis is None else axis.find("mimic")
        if axis is not None and mimic is not None:
            axis.remove(mimic)
            followers.append(joint.get("name", ""))
    for link in model.findall("link"):
        inertial = link.find("inertial")
        inertia = None if inertial is None else inertial.find("inertia")
        if inertial is not None and inertia is not None:
            mass = number(inertial.findtext("mass")) or 1.0  # SDF's default
            if lift_entries(mass, inertia.findtext, partial(_set, inertia)):
                lifted.append(link.get("name", ""))
        for role in ("visual", "collision"):
            for shape in link.findall(role):
                uri = shape.find("geometry/mesh/uri")
                if uri is None:
                    continue
                name = copying.mesh(uri.text or "", role == "collision")
                if name is None:
                    link.remove(shape)
                else:
                    uri.text = name
    copying.note(followers, "joints no longer follow others (mimic)")
    copying.note(lifted, "inertias that no body can have raised")


def _free_base(model: ET.Element, copying: Copying) -> None:
    """Drops what fixes the base that is to float."""
    if copying.base is None:
        return
    static = model.find("static")
    if static is not None:
        model.remove(static)
    for joint in model.findall("joint"):
        if joint.findtext("parent") == "world" and joint.findtext("child") == copying.base:
            model.remove(joint)
            copying.changes.append(f"joint {joint.get('name')} removed, so that {copying.base} floats")


def _set(inertia: ET.Element, name: str, text: str) -> None:
    entry = inertia.find(name)
    if entry is None:
        entry = ET.SubElement(inertia, name)
    entry.text = text
