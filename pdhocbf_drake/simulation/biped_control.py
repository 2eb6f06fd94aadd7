"""The controller of the multibody robot in a diagram, with what leads its plan to joint targets."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.fitting.preview import Step, is_mirrored, preview
from pdhocbf_drake.robot import Biped, swing_lever
from pdhocbf_drake.robot.leg import leg_length
from pdhocbf_drake.simulation.biped_plant import standing_posture
from pdhocbf_drake.simulation.build import Walk
from pdhocbf_drake.simulation.diagram import (
    add_controller,
    add_fused_controller,
    connect_controller,
    connect_fused_controller,
)
from pdhocbf_drake.simulation.feeling import connect_footing
from pdhocbf_drake.simulation.granted import grip_of
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.wiring import Form, Wiring
from pdhocbf_drake.systems.foot_reference import FootReference
from pdhocbf_drake.systems.footing import Footing
from pdhocbf_drake.systems.fused_controller import BodyBlocks
from pdhocbf_drake.systems.ground_reference import GroundReference
from pdhocbf_drake.systems.inverse_kinematics import InverseKinematics
from pdhocbf_drake.systems.torque_bias import TorqueBias
from pdhocbf_drake.systems.turn_reference import TurnReference
from pdhocbf_drake.systems.turning_zmp_offset import TurningZmpOffset
from pdhocbf_drake.systems.unbundled import unbundled
from pdhocbf_drake.systems.zmp_offset import ZmpOffset


def body_blocks(
    scenario: Scenario, walk: Walk, biped: Biped, posture: np.ndarray, footing: Footing | None
) -> BodyBlocks:
    """Planned soles, inverse kinematics, and the ZMP offset that the legs cause."""
    gait, grip, layer = walk.gait, grip_of(biped, scenario), scenario.whole_body
    uneven = gait.uneven or footing is not None
    lever = swing_lever(biped, standing_posture(walk, biped))
    # Where left and right differ, as in a turn or on a robot that is no mirror image of itself, each foot has a table.
    mirrored = is_mirrored(preview(biped, Step.of(gait.config)), leg_length(biped))
    zmp_offset = ZmpOffset if mirrored and not gait.turns else TurningZmpOffset
    limits = walk.mpc.config.plan_limits
    short = limits is not None and bool(limits.zmp_held)  # of torque in hips or knees
    return BodyBlocks(
        FootReference(gait),
        InverseKinematics(biped, posture, gait.config.tick, gait.turns, grip, uneven, layer, gait.period, short),
        zmp_offset(gait, walk.mpc.config.horizon, lever),
        TurnReference(gait) if gait.turns else None,
        GroundReference(gait) if gait.uneven else None,
        footing,
        TorqueBias(gait, biped.weight, biped.effort_limits) if scenario.biped.learns_torque else None,
    )


def add_walking(wiring: Wiring, walk: Walk, body: BodyBlocks, latency: float, form: Form) -> None:
    """Adds and connects the controller, as one block or block by block."""
    add = _add_fused if form == "fused" else _add_blocks
    add(wiring, walk, body, latency)


def _add_blocks(wiring: Wiring, walk: Walk, body: BodyBlocks, latency: float) -> None:
    """Adds and connects the controller, block by block."""
    controller = add_controller(wiring, walk, latency)
    foot_reference = wiring.add("foot_reference", body.feet)
    kinematics = wiring.add("inverse_kinematics", unbundled(body.kinematics))
    offset = wiring.add("zmp_offset", body.offset)
    connect_controller(wiring, walk, controller)
    wiring.connect(controller, "zmp_offset")
    wiring.connect(controller, "foot_state", measured=True)
    wiring.connect(foot_reference, "gait_phase", "foot_plan", "resumed")
    wiring.connect(kinematics, *["actuation"] * (body.kinematics.layer is not None))
    wiring.connect(kinematics, *["solver_status"] * body.kinematics.forgets)
    wiring.connect(kinematics, "gait_phase", "com_height", "com_reference", "zmp_reference")
    changes = "last_step", "resumed", *["course"] * walk.gait.turns
    wiring.connect(offset, "gait_phase", "whole_body_zmp", "zmp_reference", *changes)
    wiring.connect(offset, "foot_reference", "foot_plan", "stance_plan")
    if body.bias is not None:
        bias = wiring.add("torque_bias", unbundled(body.bias))
        wiring.connect(bias, "gait_phase", "solver_status", "feedforward", "actuation")
    if body.turn is not None:
        turn_reference = wiring.add("turn_reference", body.turn)
        wiring.connect(turn_reference, "gait_phase", *changes)
        wiring.connect(kinematics, "turn_reference")
    if body.ground is not None:
        ground_reference = wiring.add("ground_reference", body.ground)
        wiring.connect(ground_reference, "gait_phase", "com_reference", "zmp_reference", *changes)
    if body.footing is not None:
        connect_footing(wiring, wiring.add("footing", unbundled(body.footing)), kinematics)
        wiring.connect(controller, "landing_delay")
        return
    wiring.connect(kinematics, "foot_reference", *["ground_reference"] * (body.ground is not None))


def _add_fused(wiring: Wiring, walk: Walk, body: BodyBlocks, latency: float) -> None:
    """The same in one block."""
    controller = add_fused_controller(wiring, walk, latency, body)
    connect_fused_controller(wiring, walk, controller)
    wiring.connect(controller, *["actuation"] * (body.kinematics.layer is not None or body.bias is not None))
    measured = "foot_state", *["foot_load"] * (body.footing is not None)
    wiring.connect(controller, *measured, measured=True)
