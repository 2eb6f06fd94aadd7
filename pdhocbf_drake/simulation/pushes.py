"""From the pushes of a scenario to forces at ticks."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.scenario import Push, Scenario
from pdhocbf_drake.systems.push_schedule import TimedForce


def timed_forces(scenario: Scenario, robot: tuple[MultibodyPlant, Biped] | None = None) -> list[TimedForce]:
    """The scenario's pushes on the robot's bodies, or on the template's point mass where there is no robot.

    Raises:
        InputError: the robot has no such body.
    """
    forces = []
    for push in scenario.pushes:
        body, point = (BodyIndex(0), np.zeros(3)) if robot is None else _place(push, *robot)
        first = round(push.start(scenario.gait) / scenario.gait.tick)
        last = first + max(1, round(push.duration / scenario.gait.tick))
        forces.append(TimedForce(body, point, np.array(push.force), first, last))
    return forces


def _place(push: Push, plant: MultibodyPlant, biped: Biped) -> tuple[BodyIndex, np.ndarray]:
    """The body and its centre of mass."""
    name = push.body or biped.config.torso_link or biped.config.base_link
    if not plant.HasBodyNamed(name):
        robot = plant.get_body(plant.GetFloatingBaseBodies().pop()).model_instance()
        there = sorted(plant.get_body(index).name() for index in plant.GetBodyIndices(robot))
        raise InputError(f"pushes: the robot has no body '{name}'; it has {', '.join(there)}")
    body = plant.GetBodyByName(name)
    return body.index(), body.default_com()
