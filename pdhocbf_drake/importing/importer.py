"""Imports a robot: its model's copy, what the geometry says, the robot file and a scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pdhocbf_drake.config import as_name, parse_config
from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.importing.contacts import ignore, ignoring_groups, overlaps
from pdhocbf_drake.importing.directions import NAMES, facing, side_to_side
from pdhocbf_drake.importing.feet import check_geometry, find_feet
from pdhocbf_drake.importing.height import com_height, stride
from pdhocbf_drake.importing.inferred import Inferred, Sure
from pdhocbf_drake.importing.model_copy import ModelCopy, Report, copy_model
from pdhocbf_drake.importing.motors import motor_entries
from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.importing.robot_file import (
    Legs,
    leg_length,
    reflected_inertia,
    robot_entries,
    stance_width,
)
from pdhocbf_drake.importing.roles import find_leg
from pdhocbf_drake.importing.soles import find_sole, made_alike
from pdhocbf_drake.robot import SIDES, Biped, RobotConfig
from pdhocbf_drake.robot.parsing import listed
from pdhocbf_drake.yaml_text import write_yaml

ROBOT, SCENARIO, PAGE = "robot.yaml", "walking.yaml", "import.html"


@dataclass(frozen=True)
class Given:
    """What a user says of a model.

    Attributes:
        base: the link that floats. left_foot, right_foot: links of the feet.
        left_joints, right_joints: names of the six joints in the order of `ROLES`.
        forward: the axis of the base that points ahead, a key of `directions.NAMES`. up: that which points up.
        fixed: angles of joints beyond the legs [rad]; the others are fixed at zero.
        effort: greatest torque of joints of which the model says none [N m].
        packages: folders of `package://` names.
    """

    base: str | None = None
    left_foot: str | None = None
    right_foot: str | None = None
    left_joints: Sequence[str] | None = None
    right_joints: Sequence[str] | None = None
    forward: str | None = None
    up: str = "z"
    fixed: Mapping[str, float] = field(default_factory=dict)
    effort: float | None = None
    packages: Mapping[str, Path] = field(default_factory=dict)


@dataclass(frozen=True)
class Imported:
    """An imported robot.

    Attributes:
        biped: it. facts: what was inferred. changes: what the copy has other than the model.
    """

    biped: Biped
    facts: list[Inferred]
    changes: list[str]


def import_robot(source: Path, folder: Path, given: Given, report: Report) -> Imported:
    """Writes the copy of a model, its robot file and a scenario into an empty folder.

    Raises:
        InputError: the model can't be copied.
        ModelError: it is no biped with six joints a leg that this can read; the message says why, and names the flag
            that helps.
    """
    report("copying the model")
    copy = copy_model(source, folder, given.packages, given.base, report)
    report("reading the model")
    model = ParsedModel(copy.path)
    found, facts = read_legs(model, given)
    _check_leaders(copy, found)
    changes = [*copy.changes, *_ignored(copy, model, found)]
    config, more = _config(source, folder, copy, model, found, given, facts)
    changes.append(
        "each foot touches the ground with four spheres at its sole's corners (keep_contact: true undoes it)"
    )
    units = "lengths m, angles rad, torques N m"
    write_yaml(config, folder / ROBOT, f"Imported from {source.name}; {units}.")
    write_yaml({"extends": "walking", "robot": ROBOT, **more}, folder / SCENARIO, "pdhocbf run walking.yaml")
    return Imported(Biped.load(str(folder / ROBOT)), facts, changes)


def read_legs(model: ParsedModel, given: Given) -> tuple[Legs, list[Inferred]]:
    """Both legs of a model, and what was inferred; raises `ModelError` as `import_robot` does."""
    up = np.array(NAMES[given.up], dtype=float)
    feet = find_feet(model, up, (given.left_foot, given.right_foot))
    for limb in feet.limbs:
        check_geometry(model, limb)
    axes = side_to_side(model, feet.limbs, up)
    both = given.left_joints, given.right_joints
    names = both if both[0] is not None and both[1] is not None else (None, None)
    limbs = feet.limbs
    if names[0] is not None and names[0][0] not in [joint.name() for joint in limbs[0].joints]:
        limbs = limbs[1], limbs[0]
    legs = tuple(find_leg(model, limb, axes, six) for limb, six in zip(limbs, names, strict=True))
    faces = facing(model, (legs[0], legs[1]), axes, given.forward, given.left_foot)
    axes = axes._replace(ahead=faces.ahead, left=np.cross(up, faces.ahead))
    lateral = [float(model.points(leg.limb.bodies).mean(axis=0) @ axes.left) for leg in legs]
    left, right = legs if lateral[0] > lateral[1] else legs[::-1]
    soles = made_alike(find_sole(model, left, axes), find_sole(model, right, axes))
    found = Legs((left, right), soles, axes, leg_length(model, left))
    facts = [
        Inferred("base", model.base.name(), "--base" if given.base else "the one floating link"),
        Inferred("mass", f"{model.mass:.4g} kg", "the model"),
        Inferred("feet", f"{soles[0].link.name()}, {soles[1].link.name()}", "the ends of the limbs that reach lowest"),
        faces.fact,
        Inferred("leg", f"{found.length:.3g} m", "from hip pitch over knee to ankle"),
    ]
    if feet.waist:
        facts.append(Inferred("waist", listed(j.name() for j in feet.waist), "both legs hang from it; it is fixed"))
    for side, leg, sole in zip(SIDES, found.legs, soles, strict=True):
        roles = ", ".join(f"{role} {joint.name()}" for role, joint in leg.joints.items())
        sure: Sure = "certain" if leg.alignment > 0.95 else "likely"
        source = (
            "--left-joints, --right-joints" if names[0] else f"axes, which are {leg.alignment:.2f} along their roles'"
        )
        facts.append(Inferred(f"{side} leg", roles, source, "given" if names[0] else sure))
        length, width = 2e3 * sole.half_size
        tilt = f", {np.rad2deg(sole.tilt):.1f}° from level" if sole.tilt > 0.01 else ""
        text = f"{length:.0f} x {width:.0f} mm on {sole.link.name()}{tilt}"
        facts.append(Inferred(f"{side} sole", text, f"largest rectangle under the foot's {sole.source}",
                              "certain" if sole.source == "contact geometry" else "likely"))  # fmt: skip
    return found, facts


def _check_leaders(copy: ModelCopy, found: Legs) -> None:
    for joint in found.joints():
        if leader := copy.leaders.get(joint.name()):
            raise ModelError(
                f"joint {joint.name()!r} of a leg follows {leader!r} in the model (mimic), but each joint of a leg "
                "needs a motor of its own"
            )


def _ignored(copy: ModelCopy, model: ParsedModel, found: Legs) -> list[str]:
    """Writes into the copy which bodies ignore each other; returns the change in a sentence."""
    groups, pairs = ignoring_groups(model, found.legs), overlaps(model, found.legs)
    ignore(copy.root, [*groups, *map(list, pairs)])
    copy.save()
    overlapping = f", and what overlaps: {', '.join(' and '.join(pair) for pair in pairs)}" if pairs else ""
    return [f"a leg's own links and the rest of the body don't collide{overlapping}"] if groups else []


def _config(
    source: Path, folder: Path, copy: ModelCopy, model: ParsedModel, found: Legs, given: Given, facts: list[Inferred]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The robot file, and the scenario's further keys; adds to the facts."""
    legs = {joint.name() for joint in found.joints()}
    others = {joint.name(): joint for joint in model.moving if joint.name() not in legs}
    unknown = sorted(set(given.fixed) - set(others))
    if unknown:
        raise ModelError(
            f"there is no joint {unknown[0]!r} to fix; beyond the legs there are: {listed(others) or 'none'}"
        )
    fixed = {
        name: float(np.clip(given.fixed.get(name, 0.0), joint.position_lower_limit(), joint.position_upper_limit()))
        for name, joint in others.items()
    }
    if fixed:
        facts.append(Inferred("fixed joints", listed(fixed), "all beyond the legs, at zero or as --fix says", "likely"))
    width = stance_width(model, found)
    facts.append(width)
    name = as_name(copy.root.get("name") or copy.root.get("model") or source.stem)
    entries = robot_entries(name, copy.path.name, model, found, float(width.value.split()[0]), fixed)
    inertia = reflected_inertia(model.mass, found.length)
    motors, more = motor_entries(copy.path, model, found, given.effort, inertia)
    entries |= motors
    facts += more
    guessed = {**entries, "com_height": round(1.5 * found.length, 3)}
    biped = _biped(guessed, folder)
    height, longest, heights = com_height(biped, found.length, entries["stance_width"])
    shorter = stride(longest, found.length)
    facts += heights
    place = list(entries).index("stance_width")
    ordered = list(entries.items())
    ordered[place:place] = [("com_height", height)]
    return dict(ordered), {} if shorter is None else {"gait": {"stride": shorter}}


def _biped(entries: dict[str, Any], folder: Path) -> Biped:
    config = parse_config(RobotConfig, entries, ROBOT)
    return Biped(config.model_copy(update={"model": str(folder / config.model)}))
