"""Checks of a scenario's ground: what a sole slides on, and where a walk may start."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.ground.config import Slope
from pdhocbf_drake.robot.config import SIDES
from pdhocbf_drake.simulation.scenario import Scenario

if TYPE_CHECKING:
    from pdhocbf_drake.robot import Biped

_LEVEL = 1e-9  # [m]


def check_ground(scenario: Scenario) -> None:
    """Raises `InputError` for a slope on which soles slide, and for a friction that no ground gives with the soles."""
    for index, piece in enumerate(scenario.ground):
        own = piece.friction
        if own is not None and own >= 2.0 * scenario.friction:
            allowed = f"must be below twice that of the soles, {scenario.friction:g}"
            raise InputError(f"ground.{index}.friction: {allowed} (given: {own:g})")
        if isinstance(piece, Slope):
            along, across = (math.tan(math.radians(angle)) for angle in (piece.angle_deg, piece.roll_deg))
            incline, friction = math.hypot(along, across), scenario.friction if own is None else own
            if incline >= friction:
                most = math.degrees(math.atan(friction))
                raise InputError(
                    f"ground.{index}: soles slide down a slope of {math.degrees(math.atan(incline)):.1f}° at a "
                    f"friction of {friction:g}, which holds up to {most:.1f}°"
                )


def check_start(scenario: Scenario, biped: Biped) -> None:
    """Raises `InputError` where a sole does not lie wholly on level ground at the start."""
    terrain = scenario.terrain
    if terrain.flat:
        return
    yaw, half = scenario.start.yaw, scenario.gait.stance_width / 2.0
    ahead, aside = np.array([math.cos(yaw), math.sin(yaw)]), np.array([-math.sin(yaw), math.cos(yaw)])
    for side, away in zip(SIDES, (half, -half), strict=True):
        centre = scenario.start.position + away * aside
        length, width = biped.soles[side].half_size
        for along, across in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
            corner = centre + along * length * ahead + across * width * aside
            if abs(terrain.height(corner[0], corner[1], known=False)) > _LEVEL:
                raise InputError(
                    f"start.position: the {side} sole at x = {centre[0]:.2f} m must lie wholly on level ground, but "
                    f"its corner at x = {corner[0]:.2f} m is at an edge or on a slope"
                )
