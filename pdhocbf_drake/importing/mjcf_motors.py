"""Greatest torques of the joints of an MJCF file, as joints, actuators and classes say them, as motors for Drake."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator

from pdhocbf_drake.robot.model_text import number

_ACTUATORS = {"general", "motor", "position", "velocity", "intvelocity", "damper"}
Attributes = dict[str, dict[str, str]]


def write_motors(root: ET.Element) -> None:
    """Gives each joint that has a greatest torque one motor with that as its force range.

    It is the least of the joint's own `actuatorfrcrange` and of what its actuators can: `forcerange` times `gear`, and
    of a motor `ctrlrange` times `gear`; each its own, or its class's.
    """
    classes: dict[str, Attributes] = {"main": {}} | dict(_classes(root, {}))
    efforts: dict[str, float] = {}

    def note(name: str | None, effort: float) -> None:
        if name is not None and effort > 0.0:
            efforts[name] = min(effort, efforts.get(name, effort))

    for joint, inherited in _joints(root, "main"):
        given = classes.get(joint.get("class", inherited), {}).get("joint", {}) | joint.attrib
        note(joint.get("name"), _end(given, "actuatorfrc"))
        for key in ("actuatorfrcrange", "actuatorfrclimited"):
            joint.attrib.pop(key, None)
    for actuator in root.findall("actuator"):
        for motor in list(actuator):
            if motor.tag not in _ACTUATORS:
                continue
            given = classes.get(motor.get("class", "main"), {}).get("actuator", {}) | motor.attrib
            gear = abs(number((given.get("gear") or "1").split()[0]) or 1.0)
            note(motor.get("joint"), gear * _end(given, "force"))
            if motor.tag == "motor":
                note(motor.get("joint"), gear * _end(given, "ctrl"))
            if motor.get("joint") in efforts or motor.tag != "motor":
                actuator.remove(motor)
    if efforts:
        written = ET.SubElement(root, "actuator")
        for name, effort in efforts.items():
            span = f"{-effort:.9g} {effort:.9g}"
            ET.SubElement(written, "motor", name=f"{name}_motor", joint=name, forcelimited="true", forcerange=span)


def _classes(element: ET.Element, above: Attributes) -> Iterator[tuple[str, Attributes]]:
    """Attributes that each class of defaults gives to joints and actuators."""
    for default in element.findall("default"):
        own = {kind: dict(values) for kind, values in above.items()}
        for child in default:
            kind = "actuator" if child.tag in _ACTUATORS else child.tag
            own.setdefault(kind, {}).update(child.attrib)
        yield default.get("class", "main"), own
        yield from _classes(default, own)


def _joints(element: ET.Element, inherited: str) -> Iterator[tuple[ET.Element, str]]:
    """The joints of all bodies below, with the class that their bodies give them."""
    for child in element:
        if child.tag in ("worldbody", "body"):
            inside = child.get("childclass", inherited)
            for joint in child.findall("joint"):
                yield joint, inside
            yield from _joints(child, inside)


def _end(given: dict[str, str], what: str) -> float:
    """The upper end of a range of an element; 0 where it has none."""
    span = (given.get(f"{what}range") or "").split()
    if given.get(f"{what}limited") == "false" or len(span) != 2:
        return 0.0
    return number(span[1]) or 0.0
