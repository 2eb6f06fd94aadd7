"""The safe copy of an MJCF file of MuJoCo."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.importing.copying import Copying
from pdhocbf_drake.importing.inertia import lifted
from pdhocbf_drake.importing.mjcf_motors import write_motors
from pdhocbf_drake.robot.model_text import number, read_xml

_KEPT = {"compiler", "option", "default", "asset", "worldbody", "contact", "actuator"}
_SHAPES = {"geom", "light", "camera", "site"}


def copy_mjcf(root: ET.Element, copying: Copying) -> None:
    """Rewrites the tree in place, with the files that it includes; raises `InputError` for one that is not there."""
    _include(root, copying.source.parent, copying.source)
    root[:] = [element for element in root if element.tag in _KEPT]
    for world in root.findall("worldbody"):  # floors and lights: the ground is the scenario's
        world[:] = [element for element in world if element.tag not in _SHAPES]
    for body in root.iter("body"):
        body[:] = [element for element in body if element.tag not in _SHAPES - {"geom"}]
        if body.get("name") == copying.base and not _floats(body):
            body.insert(0, ET.Element("freejoint"))
            copying.changes.append(f"{copying.base} floats")
    folders = dict[str, str]()
    for compiler in root.findall("compiler"):
        folders |= {key: compiler.attrib.pop(key) for key in ("meshdir", "assetdir") if key in compiler.attrib}
        compiler.attrib.pop("texturedir", None)
    folder = folders.get("meshdir") or folders.get("assetdir") or ""
    for asset in root.findall("asset"):
        asset[:] = [element for element in asset if element.tag in ("mesh", "material")]
        for material in asset.findall("material"):
            material.attrib.pop("texture", None)
    _drop_friction_of_turning(root)
    _drop_pairs(root)
    _copy_meshes(root, folder, copying)
    _lift_inertias(root, copying)
    write_motors(root)


def _floats(body: ET.Element) -> bool:
    return body.find("freejoint") is not None or any(joint.get("type") == "free" for joint in body.findall("joint"))


def _include(root: ET.Element, folder: Path, source: Path, depth: int = 0) -> None:
    """Puts what included files hold in the place of the tags that include them."""
    for parent in list(root.iter()):
        for element in [child for child in parent if child.tag == "include"]:
            path = folder / element.get("file", "")
            if not path.is_file() or depth > 9:
                raise InputError(f"{source} includes {element.get('file')!r}, which is not there")
            included = read_xml(path.read_text(encoding="utf-8", errors="replace"))
            _include(included, folder, source, depth + 1)
            place = list(parent).index(element)
            parent[place : place + 1] = list(included)


def _drop_friction_of_turning(root: ET.Element) -> None:
    """Leaves a geometry's sliding friction alone, which is what Drake has."""
    for geom in root.iter("geom"):
        if len(sliding := geom.get("friction", "").split()) > 1:
            geom.set("friction", sliding[0])


def _drop_pairs(root: ET.Element) -> None:
    """Drops contact pairs with a geometry that is gone, such as the floor."""
    there = {geom.get("name") for geom in root.iter("geom")}
    for contact in root.findall("contact"):
        for pair in contact.findall("pair"):
            if not {pair.get("geom1"), pair.get("geom2")} <= there:
                contact.remove(pair)


def _copy_meshes(root: ET.Element, folder: str, copying: Copying) -> None:
    """Meshes of contact geometry become convex hulls, as assets of their own."""
    missing, hulls = set(), {geom.get("mesh") for geom in root.iter("geom") if not _is_visual(geom)}
    for asset in root.findall("asset"):
        for mesh in asset.findall("mesh"):
            file = str(Path(folder) / mesh.get("file", ""))
            name = mesh.get("name") or Path(file).stem
            mesh.set("name", name)
            copied = copying.mesh(file, False)
            if copied is None:
                missing.add(name)
                asset.remove(mesh)
                continue
            if name in hulls:
                hull = copying.mesh(file, True) or ""
                ET.SubElement(asset, "mesh", {**mesh.attrib, "name": f"{name}_contact", "file": hull})
            mesh.set("file", copied)
    for body in root.iter("body"):
        body[:] = [child for child in body if not (child.tag == "geom" and child.get("mesh") in missing)]
        for geom in body.findall("geom"):
            if "mesh" in geom.attrib and not _is_visual(geom):
                geom.set("mesh", f"{geom.get('mesh')}_contact")


def _is_visual(geom: ET.Element) -> bool:
    """Whether a geometry says that it touches nothing, itself or by the name of its class."""
    return geom.get("contype") == geom.get("conaffinity") == "0" or "visual" in geom.get("class", "")


def _lift_inertias(root: ET.Element, copying: Copying) -> None:
    changed = []
    for body in root.iter("body"):
        inertial = body.find("inertial")
        if inertial is None:
            continue
        mass = number(inertial.get("mass")) or 0.0
        if mass <= 0.0:  # which Drake reads of geometry alone
            body.remove(inertial)
            for geom in body.findall("geom"):
                geom.attrib.pop("density", None)
                geom.set("mass", "0")
            continue
        key = "fullinertia" if "fullinertia" in inertial.attrib else "diaginertia"
        entries = [number(text) or 0.0 for text in inertial.get(key, "").split()]
        if len(entries) not in (3, 6):
            continue
        matrix = np.diag(entries[:3])
        if len(entries) == 6:  # xx, yy, zz, xy, xz, yz
            matrix[[0, 0, 1], [1, 2, 2]] = matrix[[1, 2, 2], [0, 0, 1]] = entries[3:]
        better = lifted(mass, matrix)
        if better is not None:
            values = [*np.diag(better), *better[[0, 0, 1], [1, 2, 2]]][: len(entries)]
            inertial.set(key, " ".join(f"{value:.9g}" for value in values))
            changed.append(body.get("name", ""))
    copying.note(changed, "inertias that no body can have raised")
