"""Writes biped.urdf from the tables below: `python build_urdf.py`.

The file is generated because the two legs are mirror images, and a table of twelve rows is easier to
review than 600 lines of XML. Frames: every link's frame sits at its parent joint, with x forward, y left
and z up when all joints are zero (legs straight). Inertias are those of homogeneous boxes. The robot is
invented (README.md); lengths are in m, masses in kg, angles in rad.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import NamedTuple

HIP_HALF_WIDTH, THIGH, SHANK, ANKLE_HEIGHT = 0.08, 0.30, 0.30, 0.055
SOLE_CENTRE, SOLE_HALF = (0.02, 0.0, -ANKLE_HEIGHT), (0.10, 0.06)  # in the foot's frame
CONTACT_RADIUS, FRICTION = 0.008, 0.8
GEAR_RATIO, ROTOR_INERTIA = 10.0, 1e-4  # reflected inertia 10² x 1e-4 = 0.01 kg m²


class Link(NamedTuple):
    """A body: mass [kg], centre of mass and box of its inertia [m]; y is for the left side."""

    name: str
    mass: float
    com: tuple[float, float, float]
    box: tuple[float, float, float]


class Joint(NamedTuple):
    """A revolute joint from the previous link of the leg: axis for the left side, limits [rad, N m, rad/s]."""

    name: str
    axis: str
    origin: tuple[float, float, float]
    lower: float
    upper: float
    effort: float
    speed: float


TORSO = Link("torso", 15.8, (0.0, 0.0, 0.13), (0.16, 0.26, 0.40))
LEG = (
    (Joint("hip_yaw", "z", (0.0, HIP_HALF_WIDTH, 0.0), -0.7, 0.7, 60, 12),
     Link("hip_yaw", 0.7, (0.0, 0.0, 0.03), (0.08, 0.08, 0.08))),
    (Joint("hip_roll", "x", (0.0, 0.0, 0.0), -0.4, 0.7, 100, 12),
     Link("hip_roll", 0.9, (-0.02, 0.0, 0.0), (0.10, 0.08, 0.08))),
    (Joint("hip_pitch", "y", (0.0, 0.0, 0.0), -1.9, 0.9, 120, 15),
     Link("thigh", 3.0, (0.0, 0.005, -0.11), (0.10, 0.09, 0.26))),
    (Joint("knee_pitch", "y", (0.0, 0.0, -THIGH), 0.0, 2.4, 150, 18),
     Link("shank", 1.2, (0.0, 0.0, -0.12), (0.07, 0.07, 0.26))),
    (Joint("ankle_pitch", "y", (0.0, 0.0, -SHANK), -1.3, 0.9, 80, 18),
     Link("ankle", 0.2, (0.0, 0.0, 0.0), (0.04, 0.04, 0.04))),
    (Joint("ankle_roll", "x", (0.0, 0.0, 0.0), -0.6, 0.6, 60, 15),
     Link("foot", 0.6, (0.02, 0.0, -0.035), (0.20, 0.12, 0.03))),
)  # fmt: skip
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def text(values: tuple[float, ...]) -> str:
    """Numbers as URDF attributes, without a minus sign on zero."""
    return " ".join(f"{value + 0.0:.6g}" for value in values)


def mirrored(values: tuple[float, float, float], side: str) -> tuple[float, float, float]:
    """The point on the right side that mirrors one on the left."""
    return (values[0], -values[1], values[2]) if side == "right" else values


def add_link(robot: ET.Element, link: Link, side: str) -> ET.Element:
    """A link with mass, the inertia of its box, and the shell that build_meshes.py draws."""
    element = ET.SubElement(robot, "link", name=f"{side}_{link.name}" if side else link.name)
    inertial = ET.SubElement(element, "inertial")
    ET.SubElement(inertial, "origin", xyz=text(mirrored(link.com, side)), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=text((link.mass,)))
    x, y, z = (length**2 * link.mass / 12 for length in link.box)
    ET.SubElement(inertial, "inertia", ixx=text((y + z,)), iyy=text((x + z,)), izz=text((x + y,)),
                  ixy="0", ixz="0", iyz="0")  # fmt: skip
    visual = ET.SubElement(element, "visual")
    ET.SubElement(ET.SubElement(visual, "geometry"), "mesh", filename=f"meshes/{element.get('name')}.gltf")
    if link.name in CAPSULES:
        add_capsule(element, link.name, side)
    return element


# Capsules for falls and for legs that cross: radius, length along z, centre (left side) [m].
CAPSULES = {"torso": (0.11, 0.20, (0.0, 0.0, 0.28)), "thigh": (0.045, 0.16, (0.0, 0.005, -0.14)),
            "shank": (0.038, 0.16, (0.0, 0.0, -0.14))}  # fmt: skip


def add_capsule(link: ET.Element, name: str, side: str) -> None:
    """The body's capsule, which nothing touches while the robot walks."""
    radius, length, centre = CAPSULES[name]
    collision = ET.SubElement(link, "collision", name=f"{name}_capsule")
    ET.SubElement(collision, "origin", xyz=text(mirrored(centre, side)), rpy="0 0 0")
    geometry = ET.SubElement(collision, "geometry")
    ET.SubElement(geometry, "drake:capsule", radius=text((radius,)), length=text((length,)))


def add_collision_filters(robot: ET.Element) -> None:
    """A leg's own bodies and the torso don't touch each other; the two legs do."""
    for side in ("left", "right"):
        group = ET.SubElement(robot, "drake:collision_filter_group", name=f"{side}_leg_and_torso")
        for member in ("thigh", "shank", "foot"):
            ET.SubElement(group, "drake:member", link=f"{side}_{member}")
        ET.SubElement(group, "drake:member", link=TORSO.name)
        ET.SubElement(group, "drake:ignored_collision_filter_group", name=f"{side}_leg_and_torso")


def add_contact_spheres(foot: ET.Element) -> None:
    """Four small spheres whose lowest points are the corners of the sole."""
    for x in (-1, 1):
        for y in (-1, 1):
            name = f"{'toe' if x > 0 else 'heel'}_{'left' if y > 0 else 'right'}"
            collision = ET.SubElement(foot, "collision", name=name)
            corner = (SOLE_CENTRE[0] + x * SOLE_HALF[0], SOLE_CENTRE[1] + y * SOLE_HALF[1])
            centre = (*corner, SOLE_CENTRE[2] + CONTACT_RADIUS)
            ET.SubElement(collision, "origin", xyz=text(centre), rpy="0 0 0")
            ET.SubElement(ET.SubElement(collision, "geometry"), "sphere", radius=text((CONTACT_RADIUS,)))
            proximity = ET.SubElement(collision, "drake:proximity_properties")
            ET.SubElement(proximity, "drake:mu_static", value=text((FRICTION,)))
            ET.SubElement(proximity, "drake:mu_dynamic", value=text((FRICTION,)))


def add_joint(robot: ET.Element, joint: Joint, side: str, parent: str, child: str) -> None:
    """A revolute joint; axes are the same on both sides, so roll and yaw limits swap sign on the right."""
    name = f"{side}_{joint.name}"
    element = ET.SubElement(robot, "joint", name=name, type="revolute")
    ET.SubElement(element, "parent", link=parent)
    ET.SubElement(element, "child", link=child)
    ET.SubElement(element, "origin", xyz=text(mirrored(joint.origin, side)), rpy="0 0 0")
    ET.SubElement(element, "axis", xyz=text(AXES[joint.axis]))
    swap = side == "right" and joint.axis != "y"
    lower, upper = (-joint.upper, -joint.lower) if swap else (joint.lower, joint.upper)
    ET.SubElement(element, "limit", lower=text((lower,)), upper=text((upper,)),
                  effort=text((joint.effort,)), velocity=text((joint.speed,)))  # fmt: skip
    transmission = ET.SubElement(robot, "transmission", name=f"{name}_transmission")
    ET.SubElement(transmission, "type").text = "transmission_interface/SimpleTransmission"
    ET.SubElement(transmission, "joint", name=name)
    actuator = ET.SubElement(transmission, "actuator", name=name)
    ET.SubElement(actuator, "drake:gear_ratio", value=text((GEAR_RATIO,)))
    ET.SubElement(actuator, "drake:rotor_inertia", value=text((ROTOR_INERTIA,)))


def build() -> ET.ElementTree:
    """The whole robot: torso, then the left leg from the hip down, then the right."""
    robot = ET.Element("robot", {"name": "biped", "xmlns:drake": "http://drake.mit.edu"})
    add_link(robot, TORSO, "")
    for side in ("left", "right"):
        parent = TORSO.name
        for joint, link in LEG:
            element = add_link(robot, link, side)
            if link.name == "foot":
                add_contact_spheres(element)
            add_joint(robot, joint, side, parent, f"{side}_{link.name}")
            parent = f"{side}_{link.name}"
    add_collision_filters(robot)
    tree = ET.ElementTree(robot)
    ET.indent(tree)
    return tree


if __name__ == "__main__":
    build().write(Path(__file__).with_name("biped.urdf"), encoding="unicode", xml_declaration=True)
