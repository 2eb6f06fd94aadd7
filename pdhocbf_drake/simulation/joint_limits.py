"""A walk within the limits of its robot's joints: bounds of the plan, and the stride that is granted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.errors import ModelError, PdhocbfError
from pdhocbf_drake.fitting.findings import Finding
from pdhocbf_drake.fitting.plan_limits import plan_limits
from pdhocbf_drake.fitting.preview import Step, preview
from pdhocbf_drake.fitting.steady_motion import OutOfReach, steady_motion
from pdhocbf_drake.mpc.programs import ProgramCache
from pdhocbf_drake.robot import ROLES, Biped, check_walk, check_zmp_box
from pdhocbf_drake.simulation.build import nominal_mpc
from pdhocbf_drake.simulation.scenario import Scenario

_FAR = 0.7  # share of a limit below which a walk is taken as it is, by its preview
_HALVINGS = 5  # of the stride


_TUNE = "`pdhocbf tune` searches a gait that asks less of a joint"


class Kept(NamedTuple):
    """A scenario with `mpc.limits` as numbers and a stride that the joints can walk, and a sentence for each change."""

    scenario: Scenario
    sentences: tuple[str, ...] = ()


def checked_walk(scenario: Scenario) -> tuple[Biped, Kept]:
    """The robot of a scenario, and its walk as `within_joint_limits`.

    Raises:
        ModelError: a box, height or stride is out of the robot's reach, or as `within_joint_limits`.
    """
    biped, gait, recovery = Biped.load(scenario.robot), scenario.gait, scenario.mpc.recovery
    heights = (gait.com_height - gait.com_height_amplitude, gait.com_height + gait.com_height_amplitude)
    check_walk(biped, stride=gait.stride, stance_width=gait.stance_width, com_heights=heights, zmp_box=gait.zmp_box)
    if recovery is not None and recovery.zmp_box is not None:
        check_zmp_box(biped, recovery.zmp_box, "mpc.recovery.zmp_box")
    return biped, within_joint_limits(scenario, biped)


def within_joint_limits(scenario: Scenario, biped: Biped) -> Kept:
    """The scenario within the limits of the robot's joints, where `mpc.limits` is "model".

    Raises:
        ModelError: the joints can't hold the robot, or can't even step in place.
    """
    if scenario.mpc.limits != "model":
        return Kept(scenario)
    limits = plan_limits(biped, scenario.gait)
    limited = scenario.model_copy(update={"mpc": scenario.mpc.model_copy(update={"limits": limits})})
    if scenario.commands or scenario.path or not _is_near(biped, limited):
        return Kept(limited)
    return _granted(biped, limited)


def joint_findings(scenario: Scenario, biped: Biped) -> list[Finding]:
    """What the joints leave to the plan of a walk within reach, and what that changes."""
    try:
        kept = within_joint_limits(scenario, biped)
    except ModelError as error:
        return [Finding("joint limits", "fault", "mpc.limits", str(error), "null leaves them to the motors")]
    limits = kept.scenario.mpc.plan_limits
    if limits is None:
        return [Finding("joint limits", "ok", "mpc.limits", "left to the motors")]
    x, y = limits.step_reach
    said = (
        f"the ankles carry the ZMP from {-limits.zmp_behind:.3g} to {limits.zmp_ahead:.3g} m of the soles' centres and "
        f"up to {limits.zmp_outward:.3g} m outward; steps of up to {x:.3g} m, {y:.3g} m aside"
    )
    ways = [Finding("granted stride", "note", "gait.stride", sentence, _TUNE) for sentence in kept.sentences]
    return [Finding("joint limits", "ok", "mpc.limits", said), *ways]


def _is_near(biped: Biped, scenario: Scenario) -> bool:
    seen = preview(biped, Step.of(scenario.gait))
    used = max((seen.torques / biped.effort_limits).max(), (seen.speeds / biped.velocity_limits).max())
    return bool(seen.missed) or bool(used > _FAR)


def _granted(biped: Biped, scenario: Scenario) -> Kept:
    """The longest stride up to the commanded one that keeps every joint within its limits."""
    asked, programs = scenario.gait.stride, ProgramCache()
    first = _exceeded(biped, scenario, asked, programs)
    if not first:
        return Kept(scenario)
    if in_place := _exceeded(biped, scenario, 0.0, programs):
        raise ModelError(f"robot {biped.config.name!r} can't walk, not even in place: {in_place}; {_TUNE}")
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _exceeded(biped, scenario, middle * asked, programs) else (middle, high)
    stride = round(low * asked, 4)
    gait = scenario.gait.model_copy(update={"stride": stride})
    duration = gait.ticks_per_step * gait.tick
    said = (
        f"a stride of {stride:.3g} m is granted instead of {asked:g} m, {stride / duration:.3g} instead of "
        f"{asked / duration:.3g} m/s: {first}"
    )
    return Kept(scenario.model_copy(update={"gait": gait}), (said,))


def _exceeded(biped: Biped, scenario: Scenario, stride: float, programs: ProgramCache) -> str:
    """What a steady walk asks of a joint beyond its limit; empty where all are within theirs."""
    try:
        motion = steady_motion(biped, nominal_mpc(scenario, stride, programs))
    except PdhocbfError as error:
        return _of_ankles(biped, scenario) or str(error)
    if isinstance(motion, OutOfReach):
        return motion.reason
    for values, limits, unit in (
        (motion.torques, biped.effort_limits, "N m"),
        (motion.speeds, biped.velocity_limits, "rad/s"),
    ):
        peaks = np.abs(values).max(axis=0)
        joint = int((peaks / limits).argmax())
        if peaks[joint] > limits[joint]:
            missing = peaks[joint] - limits[joint]
            return (
                f"{biped.joint_names[joint]} needs {peaks[joint]:.3g} {unit} and has {limits[joint]:.3g} {unit}, "
                f"{missing:.2g} {unit} are missing"
            )
    return ""


def _of_ankles(biped: Biped, scenario: Scenario) -> str:
    """Which ankle joints leave the ZMP too little of the soles for a walk that can't be planned, if any do."""
    limits, half = scenario.mpc.plan_limits, np.array(scenario.gait.zmp_box) / 2.0
    assert limits is not None
    for role, low, high, edge in (
        ("ankle_pitch", limits.zmp_behind, limits.zmp_ahead, half[0]),
        ("ankle_roll", limits.zmp_inward, limits.zmp_outward, half[1]),
    ):
        if min(low, high) < edge:
            has = biped.effort_limits.reshape(2, -1)[:, ROLES.index(role)].min()
            return (
                f"{role} has {has:.3g} N m, which leaves the ZMP only from {-1e3 * min(low, edge):.0f} to "
                f"{1e3 * min(high, edge):.0f} mm of the soles' centres, too little to plan it"
            )
    return ""
