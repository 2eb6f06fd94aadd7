"""Imports a robot: its model's copy, what the geometry says, the robot file and a scenario."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pdhocbf_drake.config import as_name, parse_config
from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.importing.contacts import ignore, ignoring_groups, overlaps
from pdhocbf_drake.importing.first_walk import first_walk
from pdhocbf_drake.importing.given import Given
from pdhocbf_drake.importing.height import com_height, stride
from pdhocbf_drake.importing.inferred import Inferred
from pdhocbf_drake.importing.model_copy import ModelCopy, Report, copy_model
from pdhocbf_drake.importing.motors import motor_entries
from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.importing.reading import read_legs
from pdhocbf_drake.importing.robot_file import (
    Legs,
    reflected_inertia,
    robot_entries,
    stance_width,
)
from pdhocbf_drake.importing.unsupported import noting_what_drake_leaves_out
from pdhocbf_drake.importing.upright import fit_better_as_stored
from pdhocbf_drake.robot import Biped, RobotConfig
from pdhocbf_drake.robot.parsing import listed
from pdhocbf_drake.yaml_text import write_yaml

ROBOT, SCENARIO, PAGE = "robot.yaml", "walking.yaml", "import.html"


@dataclass(frozen=True)
class Imported:
    """An imported robot.

    Attributes:
        biped: it. facts: what was inferred. changes: what the copy has other than the model.
        faults: what `pdhocbf check` finds wrong with its walk.
    """

    biped: Biped
    facts: list[Inferred]
    changes: list[str]
    faults: list[str]


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
    with noting_what_drake_leaves_out() as left_out:
        model = ParsedModel(copy.path, str(source))
    if fit_better_as_stored(model, copy.meshes.turns):
        copy.meshes.write_as_stored(report)
        model = ParsedModel(copy.path)
    found, facts = read_legs(model, given)
    _check_leaders(copy, found)
    changes = [*copy.changes, *left_out.remove_from(copy.root), *_ignored(copy, model, found)]
    config, more = _config(source, folder, copy, model, found, given, facts)
    changes.append(
        "each foot touches the ground with four spheres at its sole's corners (keep_contact: true undoes it)"
    )
    units = "lengths m, angles rad, torques N m"
    write_yaml(config, folder / ROBOT, f"Imported from {source.name}; {units}.")
    name = as_name(f"{config['name']}-walking")  # so that runs of several robots are told apart
    scenario = {"name": name, "extends": "walking", "robot": ROBOT, **more}
    write_yaml(scenario, folder / SCENARIO, "pdhocbf run walking.yaml")
    walk = first_walk(folder / SCENARIO, report)
    if walk.gait:
        write_yaml(scenario | {"gait": more.get("gait", {}) | walk.gait}, folder / SCENARIO, "pdhocbf run walking.yaml")
        given_up = ", ".join(f"{key} {value:g}" for key, value in walk.gait.items())
        facts.append(Inferred("gait", given_up, f"in the usual walk {walk.why}", "likely"))
    return Imported(Biped.load(str(folder / ROBOT)), facts, changes, walk.faults)


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
    named = copy.root if copy.root.tag != "sdf" else copy.root.find("model")
    own = None if named is None else named.get("name") or named.get("model")
    name = as_name(own or source.stem)
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
