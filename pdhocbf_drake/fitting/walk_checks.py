"""Checks of a walk against its robot, without a simulation: reach, swing leg, torques, speeds, time of a step."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.fitting.findings import Finding, level_of
from pdhocbf_drake.fitting.preview import Step, preview, zmp_shift
from pdhocbf_drake.fitting.step import LARGEST_SHIFT, SHIFT
from pdhocbf_drake.robot import (
    ROLES,
    SIDES,
    Biped,
    InverseDynamics,
    WholeBodyIk,
    check_apart,
    check_walk,
    check_zmp_box,
    sole_pose,
    swing_lever,
    upright_posture,
)
from pdhocbf_drake.walking.com_height import GRAVITY
from pdhocbf_drake.walking.config import GaitConfig

if TYPE_CHECKING:  # which loads the MPC
    from pdhocbf_drake.fitting.steady_motion import SteadyMotion

_GOOD = 0.8  # share of a joint's limit
_ROUNDED = 1.05  # what rounding to whole ticks does to the swing leg's share
GOOD_TIME, _LONGEST_TIME = 2.3, 3.0  # ω T of a step, in which a fall grows by e^(ω T)


def walk_findings(
    biped: Biped, gait: GaitConfig, recovery_box: tuple[float, float] | None, motion: SteadyMotion | None = None
) -> list[Finding]:
    """Every check of a walk; where its postures are out of reach those of its motion are left out.

    Args:
        recovery_box: `mpc.recovery.zmp_box`, None where there is none [m].
        motion: of the planned walk; otherwise torques and speeds are those of a preview, whose ZMP is in the middle of
            the sole, and which asks more of the ankles than a plan does that keeps their limits.
    """
    found = [
        _box(biped, "gait.zmp_box", gait.zmp_box, "of the walk"),
        _box(biped, "mpc.recovery.zmp_box", recovery_box, "of a recovery"),
    ]
    apart = _apart(biped, gait)
    found += [apart, *(_reach(biped, gait) if apart.level == "ok" else ()), _time(biped, gait)]
    if all(finding.level != "fault" for finding in found if finding.check in ("feet", "reach")):
        found += [*motion_findings(biped, gait, motion)]
    return found


def is_refused(found: Sequence[Finding]) -> bool:
    """Whether `simulate` refuses the walk."""
    return any(finding.level == "fault" for finding in found if finding.check in ("feet", "reach", "ZMP box"))


def motion_findings(biped: Biped, gait: GaitConfig, motion: SteadyMotion | None = None) -> Iterator[Finding]:
    """The checks of a walk's motion, see `walk_findings`, some hundredths of a second; nothing if it can't stand."""
    half, height = gait.stance_width / 2.0, gait.com_height
    feet = sole_pose(0.0, half), sole_pose(0.0, -half)
    try:
        posture = upright_posture(biped, np.array([0.0, 0.0, height]), *feet)
    except ModelError:
        return
    yield _swing(biped, gait, float(swing_lever(biped, posture)[0]))
    yield _standing(biped, gait, motion is not None)
    if motion is None:
        seen = preview(biped, Step.of(gait))
        if seen.missed:
            yield Finding("step", "note", "gait.stride, gait.com_height", f"in a step, {seen.missed}", _LOWER)
            return
        torques, speeds = seen.torques, seen.speeds
    else:
        torques, speeds = (abs(values).max(axis=0) for values in (motion.torques, motion.speeds))
    yield from effort_findings(biped, torques, speeds, "in a step", ("walking torque", "joint speed"))


def effort_findings(
    biped: Biped, torques: np.ndarray, speeds: np.ndarray, when: str, checks: tuple[str, str]
) -> Iterator[Finding]:
    """Largest joint torques (12,) [N m] and speeds (12,) [rad/s] against their limits; `checks` are their names."""
    yield _torque(checks[0], when, torques, biped, "gait.stride, gait.com_height")
    yield _share(
        checks[1], when, speeds, biped.velocity_limits, biped, "rad/s",
        "gait.stride, gait.ticks_per_step", "a shorter stride or more ticks per step",
    )  # fmt: skip


_LOWER = "a lower com_height or a shorter stride"
_LESS_TORQUE = {
    "hip_yaw": "a shorter stride asks for less",
    "hip_roll": "feet closer together, by a smaller stance_width, ask for less",
    "hip_pitch": "straighter knees, by a higher com_height, carry more",
    "knee_pitch": "straighter knees, by a higher com_height, carry more",
    "ankle_pitch": "a shorter stride or zmp_box asks for less",
    "ankle_roll": "a narrower zmp_box asks for less",
}


def _box(biped: Biped, key: str, box: tuple[float, float] | None, of: str) -> Finding:
    try:
        if box is not None:
            check_zmp_box(biped, box, key)
    except ModelError as error:
        return Finding("ZMP box", "fault", key, str(error), "make it as large as the smaller sole at most")
    said = f"none {of}" if box is None else f"that {of}, {box[0]:g} x {box[1]:g} m, is within the soles"
    return Finding("ZMP box", "ok", key, said)


def _apart(biped: Biped, gait: GaitConfig) -> Finding:
    key = "gait.stance_width, stance_width of the robot"
    try:
        check_apart(biped, gait.stance_width)
    except ModelError as error:
        return Finding("feet", "fault", key, str(error), "set them further apart")
    return Finding("feet", "ok", key, f"{gait.stance_width:g} m apart, without overlap of the soles")


def _reach(biped: Biped, gait: GaitConfig) -> Iterator[Finding]:
    height, amplitude = gait.com_height, gait.com_height_amplitude
    for key, stride in (("gait.com_height", 0.0), ("gait.stride", gait.stride)):
        try:
            check_walk(
                biped,
                stride=stride,
                stance_width=gait.stance_width,
                com_height=height,
                amplitude=amplitude,
                zmp_box=(1e-6, 1e-6),  # boxes have a check of their own
            )
        except ModelError as error:
            yield Finding("reach", "fault", key, str(error), "choose one that is allowed")
            return
        around = f"CoM at {height - amplitude:.3g} to {height + amplitude:.3g} m"
        said = around if not stride else f"steps of {stride:g} m"
        yield Finding("reach", "ok", key, f"{said} within the legs' reach")


def _swing(biped: Biped, gait: GaitConfig, lever: float) -> Finding:
    half, swing = _half_sole(biped), Step.of(gait).swing
    shift = zmp_shift(lever, gait.stride, swing)
    level = level_of(shift / half, SHIFT * _ROUNDED, LARGEST_SHIFT)
    said = f"the swing leg shifts the ZMP by up to {1e3 * shift:.0f} mm, {shift / half:.2f} of the half sole"
    time = swing * math.sqrt(shift / half / SHIFT)
    ticks = math.ceil(time / gait.tick) + gait.double_support_ticks
    shorter = f"gait.stride {_stride(biped, gait, lever, gait.ticks_per_step):.3g}"
    # A step that long would get a note on its time.
    cure = f"gait.ticks_per_step {ticks}, or {shorter}" if ticks <= _most_ticks(gait) else shorter
    fix = f"up to {SHIFT:g} walks well: {cure}"
    return Finding("swing leg", level, "gait.stride, gait.ticks_per_step", said, "" if level == "ok" else fix)


def _standing(biped: Biped, gait: GaitConfig, planned: bool) -> Finding:
    """Standing on one foot with the other one at its place, which a walk whose motion is planned need not do."""
    half, key = gait.stance_width / 2.0, "gait.stance_width, gait.com_height"
    try:
        on_one = upright_posture(
            biped, np.array([0.0, half, gait.com_height]), sole_pose(0.0, half), sole_pose(0.0, -half)
        )
    except ModelError as error:
        return Finding(
            "static torque", "note", key, f"standing on one foot: {error}", "a smaller stance_width, or lower"
        )
    found = _torque("static torque", "standing on one foot", _static_torques(biped, on_one), biped, "gait.com_height")
    return found._replace(level="note") if planned and found.level == "fault" else found


def _static_torques(biped: Biped, posture: np.ndarray) -> np.ndarray:
    ik = WholeBodyIk(biped)
    rest = np.zeros(biped.plant.num_velocities())
    # The other leg's torques are those of a mirror image, which stands on the right foot.
    return abs(InverseDynamics(biped, ik.task_space)(posture, rest, rest, 1.0).tau)


def _torque(check: str, when: str, torques: np.ndarray, biped: Biped, key: str) -> Finding:
    key = f"{key}, effort_limits of the robot"
    role = ROLES[int((torques / biped.effort_limits).argmax()) % len(ROLES)]
    fix = f"{_LESS_TORQUE[role]}; or give the limits of the real motors"
    return _share(check, when, torques, biped.effort_limits, biped, "N m", key, fix)


def _share(
    check: str, when: str, values: np.ndarray, limits: np.ndarray, biped: Biped, unit: str, key: str, fix: str
) -> Finding:
    joint = int((values / limits).argmax())
    share = float(values[joint] / limits[joint])
    name = biped.joint_names[joint]
    said = f"{name} needs {values[joint]:.3g} {unit} {when}, {share:.2f} of its limit"
    level = level_of(share, _GOOD, 1.0)
    return Finding(check, level, key, said, "" if level == "ok" else fix)


def _half_sole(biped: Biped) -> float:
    return min(float(biped.soles[side].half_size[0]) for side in SIDES)


def _stride(biped: Biped, gait: GaitConfig, lever: float, ticks: int) -> float:
    """The stride at which the swing leg moves the ZMP by `SHIFT` of the half sole in steps of so many ticks [m]."""
    swing = (ticks - gait.double_support_ticks) * gait.tick
    return math.copysign(SHIFT * _half_sole(biped) / zmp_shift(lever, 1.0, swing), gait.stride)


def _most_ticks(gait: GaitConfig) -> int:
    """The ticks of a step in which a fall grows little enough."""
    return int(GOOD_TIME * math.sqrt(gait.com_height / GRAVITY) / gait.tick)


def _time(biped: Biped, gait: GaitConfig) -> Finding:
    duration, omega = gait.ticks_per_step * gait.tick, math.sqrt(GRAVITY / gait.com_height)
    level = level_of(omega * duration, GOOD_TIME, _LONGEST_TIME)
    said = f"steps of {duration:.3g} s, in which a fall grows {math.exp(omega * duration):.3g} times"
    if level == "ok":
        return Finding("step time", level, "gait.ticks_per_step", said)
    most, half = _most_ticks(gait), gait.stance_width / 2.0
    fix = f"gait.ticks_per_step {most} or fewer"
    with suppress(ModelError):  # which is a finding of its own
        posture = upright_posture(
            biped, np.array([0.0, 0.0, gait.com_height]), sole_pose(0.0, half), sole_pose(0.0, -half)
        )
        shorter = _stride(biped, gait, float(swing_lever(biped, posture)[0]), most)
        fix += f", with gait.stride {shorter:.3g}" if abs(shorter) < abs(gait.stride) else ""
    return Finding("step time", level, "gait.ticks_per_step", said, fix)
