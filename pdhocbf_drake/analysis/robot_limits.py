"""Limits of a robot, with which the metrics and figures compare a run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.simulation.scenario import Scenario

Array = NDArray[np.float64]


class RobotLimits(NamedTuple):
    """Joints in the order of `systems.signals.JOINTS`.

    Attributes:
        sole_half: (2, 2) half length and half width of the left, then the right sole [m].
        effort: (12,) largest torque [N m].
        position: (12, 2) lowest and highest angle [rad].
        speed: (12,) largest speed [rad/s].
        weight: [N].
        ahead: x axis of the torso in the floating base (3,).
        base: places of the floating base in the robot's velocities, turn first (6,).
        base_origin: places of its origin in the robot's positions (3,).
    """

    sole_half: Array
    effort: Array
    position: Array
    speed: Array
    weight: float
    ahead: Array = np.array([1.0, 0.0, 0.0])
    base: NDArray[np.intp] = np.arange(6)
    base_origin: NDArray[np.intp] = np.arange(4, 7)


def robot_limits(scenario: Scenario) -> RobotLimits | None:
    """The limits of the scenario's robot; None for a template, which has no body."""
    if scenario.system != "biped":
        return None
    biped = Biped.load(scenario.robot)
    half_sizes = np.array([biped.soles[side].half_size for side in SIDES])
    return RobotLimits(
        half_sizes, biped.effort_limits, biped.position_limits, biped.velocity_limits, biped.weight, biped.ahead,
        biped.base_v_index, biped.base_q_index[4:],
    )  # fmt: skip
