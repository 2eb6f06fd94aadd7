"""What a robot's joints leave to the plan: the ZMP that its ankles can carry, and the steps that its legs can make."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.fitting.preview import Step, preview
from pdhocbf_drake.mpc.config import PlanLimits
from pdhocbf_drake.robot import SIDES, Biped, InverseDynamics, WholeBodyIk, longest_stride, sole_pose, upright_posture
from pdhocbf_drake.robot.reach import widest_step
from pdhocbf_drake.walking.com_height import GRAVITY
from pdhocbf_drake.walking.config import GaitConfig

TORQUE = 0.85
"""Share of an ankle's torque for the ZMP; the rest is for horizontal forces, and for tracking."""

_SPEED = 0.9  # share of the joints' speed limits in the longest step
_FARTHEST = 10.0  # [m], what a limit that is never met is written as


class _Ankle(NamedTuple):
    """Places of an ankle's axes from the sole's centre, and how far the ZMP may be from these [m]."""

    ahead: float
    outward: float
    pitch: float
    roll: float


def plan_limits(biped: Biped, gait: GaitConfig) -> PlanLimits:
    """The limits of a walk's plan.

    An ankle that carries the load m(g + z̈) keeps the ZMP within τ/(m(g + z̈)) of its axis, by the largest z̈ of a step.
    A share of 0.15 is left for the moment of the horizontal force about that axis, and for tracking.

    Raises:
        ModelError: the posture is out of reach, a joint can't hold it, or an ankle leaves no room for the ZMP.
    """
    half, height = gait.stance_width / 2.0, gait.com_height
    q = upright_posture(biped, np.array([0.0, 0.0, height]), sole_pose(0.0, half), sole_pose(0.0, -half))
    _check_standing(biped, q)
    rise = gait.com_height_amplitude * (2.0 * math.pi / (gait.ticks_per_step * gait.tick)) ** 2
    load = biped.mass * (GRAVITY + rise)
    ankles = _ankles(biped, q, load)
    room = {
        "zmp_behind": min(a.pitch - a.ahead for a in ankles),
        "zmp_ahead": min(a.pitch + a.ahead for a in ankles),
        "zmp_inward": min(a.roll - a.outward for a in ankles),
        "zmp_outward": min(a.roll + a.outward for a in ankles),
    }
    _check_room(biped, room, load)
    rooms = {name: _rounded(min(value, _FARTHEST)) for name, value in room.items()}
    return PlanLimits.model_validate({**rooms, "step_reach": _step_reach(biped, gait)})


def _check_standing(biped: Biped, q: np.ndarray) -> None:
    ik, rest = WholeBodyIk(biped), np.zeros(biped.plant.num_velocities())
    needed = np.abs(InverseDynamics(biped, ik.task_space)(q, rest, rest, 0.5).tau)
    missing = needed - biped.effort_limits
    joint = int(missing.argmax())
    if missing[joint] > 0.0:
        raise ModelError(
            f"robot {biped.config.name!r} can't stand: {biped.joint_names[joint]} needs {needed[joint]:.3g} N m for "
            f"that and has {biped.effort_limits[joint]:.3g} N m, {missing[joint]:.2g} N m are missing"
        )


def _check_room(biped: Biped, room: dict[str, float], load: float) -> None:
    """Refuses ankles that leave nothing of the sole for the ZMP."""
    half = np.min([biped.soles[side].half_size for side in SIDES], axis=0)
    pairs = (("pitch", "zmp_behind", "zmp_ahead", half[0]), ("roll", "zmp_inward", "zmp_outward", half[1]))
    for name, lower, upper, edge in pairs:
        left = min(room[lower], edge) + min(room[upper], edge)
        if left <= 0.0:
            raise ModelError(
                f"robot {biped.config.name!r} can't walk: its ankles' {name} joints leave the ZMP no room "
                f"on the soles under {load:.3g} N; {-left * load / TORQUE:.2g} N m are missing"
            )


def _ankles(biped: Biped, q: np.ndarray, load: float) -> list[_Ankle]:
    """Both ankles of a robot that stands in q (19,), facing along x, under a load [N]."""
    plant, names = biped.plant, list(biped.joint_names)
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    found = []
    for side, outward in zip(SIDES, (1.0, -1.0), strict=True):
        leg = biped.config.leg(side).joints
        joints = leg.ankle_pitch, leg.ankle_roll
        sole = biped.soles[side].frame.CalcPoseInWorld(context).translation()
        pitch, roll = (
            plant.GetJointByName(joint).frame_on_child().CalcPoseInWorld(context).translation() for joint in joints
        )
        limits = [TORQUE / load * float(biped.effort_limits[names.index(joint)]) for joint in joints]
        found.append(_Ankle(float(pitch[0] - sole[0]), float(outward * (roll[1] - sole[1])), *limits))
    return found


def _step_reach(biped: Biped, gait: GaitConfig) -> tuple[float, float]:
    """The longest and the widest step that legs and the swinging leg's joint speeds allow [m]."""
    highest = gait.com_height + gait.com_height_amplitude
    longest, widest = longest_stride(biped, gait.stance_width, highest), widest_step(biped, highest)
    if gait.stride:
        seen = preview(biped, Step.of(gait))
        share = 0.0 if seen.missed else float((seen.speeds / biped.velocity_limits).max())
        if share > 0.0:  # speeds grow less than in proportion to the step
            longest = min(longest, abs(gait.stride) * max(_SPEED / share, 1.0))
    return _rounded(longest), _rounded(widest)


def _rounded(value: float) -> float:
    """Down to tenths of millimetres [m]."""
    return math.floor(value * 1e4) / 1e4
