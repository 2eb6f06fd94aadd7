"""Effort limits and reflected inertias of the legs' joints: the model's, or those that it lacks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from pydrake.multibody.tree import JointActuator

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.importing.inferred import Inferred, Sure
from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.importing.robot_file import Legs
from pdhocbf_drake.robot.model_text import JointText, joint_texts
from pdhocbf_drake.robot.per_joint import ROLES

_NO_LIMIT = 1e6  # [N m]: more than any joint has


def motor_entries(
    path: Path, model: ParsedModel, found: Legs, effort: float | None, inertia: float
) -> tuple[dict[str, Any], list[Inferred]]:
    """Keys of the robot file for what the model says nothing of, and the facts.

    Args:
        path: the copy of the model. model: it, as Drake reads it. found: its legs.
        effort: greatest torque of joints without one [N m], None if it is not known.
        inertia: reflected inertia of joints without one [kg m²].

    Raises:
        ModelError: a joint has no effort, and none is given.
    """
    plant, texts, entries = model.plant, joint_texts(path), dict[str, Any]()
    every = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    actuators = {actuator.joint().name(): actuator for actuator in every}
    efforts = {joint.name(): _effort(actuators, texts, joint.name()) for joint in found.joints()}
    lacking = [name for name, value in efforts.items() if value is None]
    if lacking and effort is None:
        raise ModelError(
            f"the model says no greatest torque of {', '.join(lacking)}: give --effort with one for those [N m]"
        )
    known = [value if value is not None else float(effort or 0.0) for value in efforts.values()]
    if lacking:
        half = len(ROLES)
        entries["effort_limits"] = {"left": known[:half], "right": known[half:]}
    source = "the model's actuators or limits" if not lacking else f"--effort for {', '.join(lacking)}"
    if max(known) > _NO_LIMIT:
        source += ", which says so that it has none for some"
    sure: Sure = "certain" if max(known) <= _NO_LIMIT else "guess"
    facts = [Inferred("effort limits", f"{min(known):.4g} to {max(known):.4g} N m", source, sure)]
    reflected = [_reflected(actuators.get(joint.name())) for joint in found.joints()]
    if min(reflected) <= 0.0:
        entries["reflected_inertia"] = inertia
        facts.append(Inferred("reflected inertia", f"{inertia:g} kg m²", "mass and length of the legs", "guess"))
    return entries, facts


def _effort(actuators: dict[str, JointActuator], texts: dict[str, JointText], name: str) -> float | None:
    """The model's greatest torque of a joint; None where there is none."""
    from_actuator = actuators[name].effort_limit() if name in actuators else math.inf
    if math.isfinite(from_actuator) and from_actuator > 0.0:
        return float(from_actuator)
    effort = texts.get(name, JointText()).effort
    return effort if effort is not None and effort > 0.0 else None


def _reflected(actuator: JointActuator | None) -> float:
    if actuator is None:
        return 0.0
    return float(actuator.default_rotor_inertia() * actuator.default_gear_ratio() ** 2)
