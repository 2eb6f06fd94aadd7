"""Checks of a robot file against its model."""

from __future__ import annotations

from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.fitting.findings import Finding
from pdhocbf_drake.robot import Biped, load_robot_config
from pdhocbf_drake.robot.leg import leg_length


def robot_findings(robot: str) -> list[Finding]:
    """The model as it is read; sides, facing, roles of the joints and bent knees; and soles against contact geometry.

    Raises:
        InputError, ModelError: there is no such robot file, or a value in it is wrong by itself.
    """
    config = load_robot_config(robot)
    try:
        biped = Biped(config, checked=False)
    except ModelError as error:
        return [Finding("model", "fault", "model", str(error), "correct the entry that is named")]
    found = [Finding("model", "ok", "model", f"{biped.mass:.3g} kg, legs of {leg_length(biped):.3g} m")]
    faults = biped.faults()
    for fault in faults:
        found.append(Finding("robot file", "fault" if fault.fatal else "note", fault.key, fault.said, fault.fix))
    if not faults:
        found.append(
            Finding("robot file", "ok", "left, right", "sides, facing, axes, bent knees and soles fit the model")
        )
    return [*found, _contact(biped)]


def _contact(biped: Biped) -> Finding:
    """The declared soles against the geometry of the feet."""
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 0.001)
    try:
        biped.add_to(plant)
    except ModelError as error:
        fix = "correct xyz, rpy or half_size of that sole"
        return Finding("contact", "fault", "left.sole, right.sole", str(error), fix)
    left, right = (biped.config.leg(side).sole.half_size for side in ("left", "right"))
    said = f"soles of {2 * left[0]:.3g} x {2 * left[1]:.3g} m" + (
        "" if left == right else f" and {2 * right[0]:.3g} x {2 * right[1]:.3g} m"
    )
    return Finding("contact", "ok", "left.sole, right.sole", f"{said} fit the geometry of the feet")
