"""What a model file says of its joints that Drake does not hand on: efforts, mimics, limits; URDF, SDF and MJCF."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import NamedTuple

_PREFIX = re.compile(r"(</?)([A-Za-z_][\w.-]*):")
_ATTRIBUTE_PREFIX = re.compile(r"(\s)([A-Za-z_][\w.-]*):([\w.-]+\s*=\s*[\"'])")
_COLON = "__colon__"
_LIMITS = ("effort", "lower", "upper")


class JointText(NamedTuple):
    """A joint as the model file writes it; None for what it leaves out.

    Attributes:
        effort: greatest torque or force [N m, N]. lower, upper: limits [rad, m].
        leader: the joint that it follows (mimic). child: the link that hangs from it, in URDF and SDF.
    """

    effort: float | None = None
    lower: float | None = None
    upper: float | None = None
    leader: str | None = None
    child: str | None = None


def read_xml(text: str) -> ET.Element:
    """The tree of a model file, with `drake:x` as the tag `drake__colon__x`: many files don't declare that prefix.

    Raises:
        ET.ParseError: it is not XML.
    """
    text = re.sub(r"\sxmlns(:[\w.-]+)?\s*=\s*(\"[^\"]*\"|'[^']*')", "", text)
    text = _PREFIX.sub(rf"\1\2{_COLON}", text)
    return ET.fromstring(_ATTRIBUTE_PREFIX.sub(rf"\1\2{_COLON}\3", text).encode())


def write_xml(root: ET.Element) -> str:
    """The text of a tree from `read_xml`, with its prefixes and the declaration of Drake's."""
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode").replace(_COLON, ":")
    if "drake:" in text and "xmlns:drake" not in text:
        text = re.sub(rf"<{root.tag}\b", f'<{root.tag} xmlns:drake="http://drake.mit.edu"', text, count=1)
    return f"<?xml version='1.0' encoding='utf-8'?>\n{text}\n"


def drake_tag(name: str) -> str:
    """The tag `drake:name` in a tree of `read_xml`."""
    return f"drake{_COLON}{name}"


def joint_texts(path: Path) -> dict[str, JointText]:
    """The joints of a model file by name; of several with one name the first, none where it is not XML."""
    try:
        root = read_xml(path.read_text(encoding="utf-8", errors="replace"))
    except (ET.ParseError, OSError):
        return {}
    read = {"robot": _urdf, "mujoco": _mjcf}.get(root.tag, _sdf)
    return read(root)


def _urdf(root: ET.Element) -> dict[str, JointText]:
    found: dict[str, JointText] = {}
    for joint in root.findall("joint"):
        limit, mimic = joint.find("limit"), joint.find("mimic")
        effort, lower, upper = (None if limit is None else number(limit.get(key)) for key in _LIMITS)
        leader, child = None if mimic is None else mimic.get("joint"), joint.find("child")
        link = None if child is None else child.get("link")
        found.setdefault(joint.get("name", ""), JointText(effort, lower, upper, leader, link))
    return found


def _sdf(root: ET.Element) -> dict[str, JointText]:
    found: dict[str, JointText] = {}
    for joint in root.iter("joint"):
        effort, lower, upper = (number(joint.findtext(f"axis/limit/{key}")) for key in _LIMITS)
        mimic = joint.find("axis/mimic")
        leader = None if mimic is None else mimic.get("joint")
        child = joint.findtext("child")
        found.setdefault(joint.get("name", ""), JointText(effort, lower, upper, leader, child))
    return found


def _mjcf(root: ET.Element) -> dict[str, JointText]:
    leaders = {pair.get("joint1"): pair.get("joint2") for pair in root.findall("equality/joint")}
    found: dict[str, JointText] = {}
    for joint in root.iter("joint"):
        name = joint.get("name", "")
        span = (joint.get("actuatorfrcrange") or "").split()
        effort = number(span[-1]) if span else None
        found.setdefault(name, JointText(effort, leader=leaders.get(name)))
    return found


def number(text: str | None) -> float | None:
    """The finite number of an attribute; None where it is missing or something else."""
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if math.isfinite(value) else None
