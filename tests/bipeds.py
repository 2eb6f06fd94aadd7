"""Bipeds for tests: copies of the packaged one of another size, and random ones, as URDF text and robot YAML."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydrake.math import RollPitchYaw

from pdhocbf_drake.robot.per_joint import ROLES

GEOMETRY_GAP = 0.008  # radius of the contact spheres of a robot of the packaged one's size [m]
AXES = {"yaw": (0.0, 0.0, 1.0), "roll": (1.0, 0.0, 0.0), "pitch": (0.0, 1.0, 0.0)}
LIMITS = dict(zip(ROLES, [(-0.7, 0.7), (-0.4, 0.7), (-1.9, 0.9), (0.0, 2.4), (-1.3, 0.9), (-0.6, 0.6)], strict=True))
EFFORTS = dict(zip(ROLES, [60.0, 100.0, 120.0, 150.0, 80.0, 60.0], strict=True))  # [N m]
SPEEDS = dict(zip(ROLES, [12.0, 12.0, 15.0, 18.0, 18.0, 15.0], strict=True))  # [rad/s]


@dataclass(frozen=True)
class Shape:
    """A biped: lengths [m] and masses [kg] of one of the packaged one's size, and how its joints are made.

    Attributes:
        size: of the whole robot; lengths go with it, masses with its cube, torques with its fourth power.
        thigh, shank, ankle, hip: lengths of the links; height of the ankle; half distance of the hips.
        sole: half length and half width. sole_x: from the ankle to the sole's centre.
        torso, leg: mass of the torso, and factor on the masses of the legs.
        torso_height: of its centre of mass above the hips.
        order: of the hip joints along the chain.
        signs: of the axes of each leg's joints, in the order of `ROLES`.
        tilt: of the axis of the first hip joint, about x or, for a roll axis, about y [rad].
        base_rpy: of the body in the frame of its link [rad].
        right: mass of the right leg over that of the left one.
    """

    size: float = 1.0
    thigh: float = 0.30
    shank: float = 0.30
    ankle: float = 0.055
    hip: float = 0.08
    sole: tuple[float, float] = (0.10, 0.06)
    sole_x: float = 0.02
    torso: float = 15.8
    leg: float = 1.0
    torso_height: float = 0.13
    order: tuple[str, str, str] = ("hip_yaw", "hip_roll", "hip_pitch")
    signs: dict[str, tuple[int, ...]] = field(default_factory=lambda: {"left": (1,) * 6, "right": (1,) * 6})
    tilt: float = 0.0
    base_rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    right: float = 1.0


def random_shape(seed: int) -> Shape:
    """A biped of random proportions, masses, hip joint order, axis signs, hip tilt and soles."""
    rng = np.random.default_rng(seed)
    u = rng.uniform
    thigh = u(0.26, 0.34)
    return Shape(
        size=float(np.exp(u(np.log(0.3), np.log(1.8)))),
        thigh=thigh,
        shank=0.6 - thigh,
        ankle=u(0.04, 0.08),
        hip=u(0.07, 0.11),
        sole=(u(0.085, 0.125), u(0.035, 0.062)),
        sole_x=u(0.0, 0.04),
        torso=u(10.0, 22.0),
        leg=u(0.7, 1.25),
        torso_height=u(0.08, 0.2),
        order=tuple(rng.permutation(["hip_yaw", "hip_roll", "hip_pitch"]).tolist()),
        signs={side: tuple(rng.choice([-1, 1], 6).tolist()) for side in ("left", "right")},
        tilt=float(rng.choice([0.0, u(-0.17, 0.17)])),
        base_rpy=tuple(rng.choice([(0.0, 0.0, 0.0), (0.0, 0.0, np.pi), (0.0, np.pi / 2.0, 0.0)]).tolist()),
    )


def write(folder: Path, shape: Shape, **changes: Any) -> Path:
    """Writes robot.urdf and robot.yaml into the folder, with keys of the latter changed, and returns its path."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.urdf").write_text(urdf(shape))
    path = folder / "robot.yaml"
    path.write_text(yaml.safe_dump(robot(shape) | changes, sort_keys=False))
    return path


def robot(shape: Shape) -> dict[str, Any]:
    """The data of the robot file, but for gains, which the package chooses."""
    scale = shape.size
    straight = shape.thigh + shape.shank + shape.ankle
    mass_height = straight + (shape.torso * shape.torso_height - 0.2 * 13.2 * shape.leg) / (
        shape.torso + 13.2 * shape.leg
    )
    data: dict[str, Any] = {
        "name": "generated",
        "model": "robot.urdf",
        "base_link": "torso",
        "com_height": round(0.915 * scale * mass_height, 4),
        "stance_width": round(2.0 * scale * max(shape.hip, shape.sole[1] + 0.02), 4),
        "torso_rpy": list(shape.base_rpy),
        "reflected_inertia": 0.01 * scale**5,
    }
    for side in ("left", "right"):
        sign = dict(zip(ROLES, shape.signs[side], strict=True))
        bend = {"hip_pitch": -0.4, "knee_pitch": 0.8, "ankle_pitch": -0.4}
        data[side] = {
            "sole": {
                "link": f"{side}_foot",
                "xyz": [scale * shape.sole_x, 0.0, -scale * shape.ankle],
                "half_size": [scale * half for half in shape.sole],
            },
            "joints": {role: f"{side}_{role}" for role in ROLES},
            "bent_knee": {role: sign[role] * angle for role, angle in bend.items()},
        }
    return data


def urdf(shape: Shape) -> str:
    """The model; where all joints are zero the legs are straight and every link is parallel to the body."""
    root = ET.Element("robot", name="generated")
    turn = RollPitchYaw(shape.base_rpy).ToRotationMatrix()
    _link(root, "torso", shape, shape.torso, (0.0, 0.0, shape.torso_height), (0.16, 0.26, 0.40), turn.matrix())
    for side, y in (("left", 1.0), ("right", -1.0)):
        _leg(root, shape, side, y, turn)
    return ET.tostring(root, encoding="unicode")


def _leg(root: ET.Element, shape: Shape, side: str, y: float, turn: Any) -> None:
    masses = {
        shape.order[0]: (0.7, (0.0, 0.0, 0.0), (0.08, 0.08, 0.08)),
        shape.order[1]: (0.9, (0.0, 0.0, 0.0), (0.08, 0.08, 0.08)),
        shape.order[2]: (3.0, (0.0, 0.005 * y, -0.11 / 0.3 * shape.thigh), (0.1, 0.09, 0.26)),
        "knee_pitch": (1.2, (0.0, 0.0, -0.4 * shape.shank), (0.07, 0.07, 0.26)),
        "ankle_pitch": (0.2, (0.0, 0.0, 0.0), (0.04, 0.04, 0.04)),
        "ankle_roll": (0.6, (shape.sole_x, 0.0, -0.6 * shape.ankle), (0.2, 0.12, 0.03)),
    }
    places = {role: (0.0, 0.0, 0.0) for role in ROLES}
    places[shape.order[0]] = (0.0, y * shape.hip, 0.0)
    places["knee_pitch"], places["ankle_pitch"] = (0.0, 0.0, -shape.thigh), (0.0, 0.0, -shape.shank)
    parent = "torso"
    for role in (*shape.order, *ROLES[3:]):
        link = f"{side}_foot" if role == "ankle_roll" else f"{side}_{role}_link"
        mass, centre, box = masses[role]
        mass *= shape.leg * (shape.right if side == "right" else 1.0)
        _link(root, link, shape, mass, centre, box, np.eye(3))
        origin, rpy = np.array(places[role]), (0.0, 0.0, 0.0)
        if parent == "torso":
            origin, rpy = turn @ origin, tuple(RollPitchYaw(turn).vector())
        _joint(root, shape, side, role, parent, link, origin, rpy)
        parent = link
    foot = root.find(f"link[@name='{side}_foot']")
    assert foot is not None
    radius = GEOMETRY_GAP
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            corner = (shape.sole_x + sx * shape.sole[0], sy * shape.sole[1], radius - shape.ankle)
            collision = ET.SubElement(foot, "collision", name=f"corner_{sx:g}_{sy:g}")
            ET.SubElement(collision, "origin", xyz=_text(shape.size * np.array(corner)))
            ET.SubElement(ET.SubElement(collision, "geometry"), "sphere", radius=f"{shape.size * radius:.9g}")


def _joint(root: ET.Element, shape: Shape, side: str, role: str, parent: str, link: str, origin: Any, rpy: Any) -> None:
    sign = shape.signs[side][ROLES.index(role)]
    axis = np.array(AXES[role.split("_")[1]])
    if role == shape.order[0] and shape.tilt:
        tilt = shape.tilt if side == "left" else -shape.tilt
        about = (0.0, shape.tilt, 0.0) if "roll" in role else (tilt, 0.0, 0.0)
        axis = RollPitchYaw(about).ToRotationMatrix() @ axis
    lower, upper = LIMITS[role]
    if side == "right" and role == "hip_roll":
        lower, upper = -upper, -lower
    lower, upper = sorted((sign * lower, sign * upper))
    joint = ET.SubElement(root, "joint", name=f"{side}_{role}", type="revolute")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=link)
    ET.SubElement(joint, "origin", xyz=_text(shape.size * origin), rpy=_text(rpy))
    ET.SubElement(joint, "axis", xyz=_text(sign * axis))
    effort = EFFORTS[role] * shape.size**4
    speed = SPEEDS[role] / shape.size**0.5
    ET.SubElement(joint, "limit", lower=f"{lower}", upper=f"{upper}", effort=f"{effort:.9g}", velocity=f"{speed:.9g}")


def _link(root: ET.Element, name: str, shape: Shape, mass: float, centre: Any, box: Any, turn: np.ndarray) -> None:
    """A homogeneous box; `turn` is the body's orientation in the link."""
    link = ET.SubElement(root, "link", name=name)
    inertial = ET.SubElement(link, "inertial")
    mass *= shape.size**3
    x, y, z = (shape.size * np.array(box)) ** 2 * mass / 12.0
    inertia = turn @ np.diag([y + z, x + z, x + y]) @ turn.T
    ET.SubElement(inertial, "origin", xyz=_text(shape.size * (turn @ np.array(centre))))
    ET.SubElement(inertial, "mass", value=f"{mass:.9g}")
    entries = {f"i{a}{b}": inertia[i, j] for i, a in enumerate("xyz") for j, b in enumerate("xyz") if j >= i}
    ET.SubElement(inertial, "inertia", {key: f"{value:.9g}" for key, value in entries.items()})


def _text(values: Any) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def resized(size: float) -> Shape:
    """A copy of the packaged biped of another size."""
    return replace(Shape(), size=size)


def narrow() -> Shape:
    """Of a common human-sized robot's proportions: hips four times as far apart as the soles are wide."""
    return replace(Shape(), size=1.06, hip=0.112, sole=(0.08, 0.0235), sole_x=0.033)
