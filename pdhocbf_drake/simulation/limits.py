"""A walk within the limits of its robot and of the ground: bounds of the plan, and the stride that is granted."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.fitting.findings import Finding
from pdhocbf_drake.fitting.held_zmp import held_zmp
from pdhocbf_drake.fitting.plan_limits import TORQUE, plan_limits
from pdhocbf_drake.fitting.preview import Step, preview
from pdhocbf_drake.fitting.steady_motion import SteadyMotion
from pdhocbf_drake.fitting.swing_acceleration import swing_acceleration
from pdhocbf_drake.fitting.walk_checks import is_refused, walk_findings
from pdhocbf_drake.mpc.config import PlanLimits
from pdhocbf_drake.mpc.programs import ProgramCache
from pdhocbf_drake.robot import ROLES, SIDES, Biped, check_walk, check_zmp_box
from pdhocbf_drake.simulation.commands import commanded_stride
from pdhocbf_drake.simulation.granted import Asked, exceeded, longest_granted
from pdhocbf_drake.simulation.ground_checks import check_start
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.uneven_checks import check_known_ground, known_ground_findings
from pdhocbf_drake.simulation.zmp_place import placed

_FAR = 0.7  # share of a joint's limit below which a walk is taken as it is, by its preview
_SLIPPERY = 0.3  # friction below which it is looked at; a walk uses some 0.08 and 20 mm about the vertical
_APART = 1.03  # distance of the feet over the least one, where friction is low
_TUNE = "`pdhocbf tune` searches a gait that asks less of a joint"


class Kept(NamedTuple):
    """A walk within limits.

    Attributes:
        scenario: with `mpc.limits` as numbers, and a stride that can be walked.
        sentences: one for each other change.
        motion: the steady motion straight ahead, where it was looked at.
    """

    scenario: Scenario
    sentences: tuple[str, ...] = ()
    motion: SteadyMotion | None = None


def checked_walk(scenario: Scenario) -> tuple[Biped, Kept]:
    """The robot of a scenario, and its walk as `within_limits`.

    Raises:
        ModelError: a box, height or stride is out of the robot's reach, or as `within_limits`.
        InputError: the walk starts on an edge or a slope, or as `check_known_ground`.
    """
    biped, gait, recovery = Biped.load(scenario.robot), scenario.gait, scenario.mpc.recovery
    check_start(scenario, biped)
    check_walk(
        biped,
        stride=gait.stride,
        stance_width=gait.stance_width,
        com_height=gait.com_height,
        amplitude=gait.com_height_amplitude,
        zmp_box=gait.zmp_box,
    )
    if recovery is not None and recovery.zmp_box is not None:
        check_zmp_box(biped, recovery.zmp_box, "mpc.recovery.zmp_box")
    check_known_ground(scenario, biped)
    return biped, within_limits(scenario, biped)


def within_its_limits(scenario: Scenario) -> Scenario:
    """The scenario of `checked_walk`, or as it is where it has no robot; raises as that does."""
    return scenario if scenario.system != "biped" else checked_walk(scenario)[1].scenario


def within_limits(scenario: Scenario, biped: Biped) -> Kept:
    """The scenario within the limits of the robot's joints and of its soles' grip, where `mpc.limits` is "model".

    Where friction does not do for the commanded walk, its gait gets cautious, see `_cautious`; then the stride is
    reduced.

    Raises:
        ModelError: the joints can't hold the robot, or it can't even step in place.
    """
    if scenario.mpc.limits != "model":
        return Kept(scenario)
    limits = plan_limits(biped, scenario.gait)
    scenario = _with(scenario, mpc={"limits": limits})
    if not _is_near(biped, scenario, limits):
        return Kept(scenario)
    limits = _in_recovery(scenario, biped, limits)
    scenario = _with(scenario, mpc={"limits": limits})
    asked, sentences, programs = commanded_stride(scenario), list[str](), ProgramCache()
    turn = max((abs(command.turn) for command in scenario.commands), default=0.0)
    walk = Asked(biped, scenario, programs, turn)
    walk, place = placed(walk, asked)
    if place:
        scenario, limits = walk.scenario, walk.scenario.mpc.plan_limits or limits
        sentences.append(place)
    first = exceeded(walk, asked)
    if first.of_ground:
        scenario, said = _cautious(scenario, biped)
        if said:
            sentences.append(f"{said}: {first.said}")
            walk = walk.changed(scenario)
            first = exceeded(walk, asked)
    if not first.said:
        return Kept(scenario, tuple(sentences), first.motion)
    stride = longest_granted(walk, asked)
    if stride is None:
        in_place = exceeded(walk, 0.0)
        hint = "friction_belief is what is reckoned with" if in_place.of_ground else _TUNE
        raise ModelError(f"robot {biped.config.name!r} can't walk, not even in place: {in_place.said}; {hint}")
    duration = scenario.gait.ticks_per_step * scenario.gait.tick
    sentences.append(
        f"a stride of {stride:.3g} m is granted instead of {asked:.3g} m, {stride / duration:.3g} instead of "
        f"{asked / duration:.3g} m/s: {first.said}"
    )
    scenario = _with(scenario, mpc={"limits": limits.model_copy(update={"stride": stride})})
    if not (scenario.commands or scenario.path):
        scenario = _with(scenario, gait={"stride": stride})
    return Kept(scenario, tuple(sentences), exceeded(walk, stride).motion)


def findings_within_limits(scenario: Scenario, biped: Biped) -> list[Finding]:
    """Every check of a walk, and what joints and friction leave to its plan, and what that changes."""
    recovery = scenario.mpc.recovery
    box = None if recovery is None else recovery.zmp_box
    found = walk_findings(biped, scenario.gait, box)
    if is_refused(found):
        return found
    try:
        kept = within_limits(scenario, biped)
    except ModelError as error:
        fix = "null leaves them to the motors"
        return [*found, Finding("limits", "fault", "mpc.limits, friction_belief", str(error), fix)]
    found = [*walk_findings(biped, kept.scenario.gait, box, kept.motion), *_limits(kept)]
    return [*found, *known_ground_findings(kept.scenario, biped)]


def _limits(kept: Kept) -> list[Finding]:
    limits = kept.scenario.mpc.plan_limits
    if limits is None:
        return [Finding("limits", "ok", "mpc.limits", "left to the motors")]
    x, y = limits.step_reach
    said = (
        f"the ankles carry the ZMP from {-limits.zmp_behind:.3g} to {limits.zmp_ahead:.3g} m of the soles' centres and "
        f"up to {limits.zmp_outward:.3g} m outward; steps of up to {x:.3g} m, {y:.3g} m aside"
    )
    if limits.zmp_held:
        back = [low for low, _ in limits.zmp_held]
        said += (
            f"; in a disturbed walk hips and knees hold the ZMP from {min(back):.3g} m on in some ticks of a step, and "
            f"from {max(back):.3g} m on in others"
        )
    if limits.swing_acceleration is not None:
        said += f"; there the hips move a landing by {limits.swing_acceleration:.3g} m/s² at most"
    key = "gait.stride, gait.zmp_box"
    return [
        Finding("limits", "ok", "mpc.limits", said),
        *(Finding("granted", "note", key, sentence, _TUNE) for sentence in kept.sentences),
    ]


def _with(scenario: Scenario, **changes: dict[str, object]) -> Scenario:
    """The scenario with other values in some of its parts."""
    parts = {part: getattr(scenario, part).model_copy(update=values) for part, values in changes.items()}
    return scenario.model_copy(update=parts)


def _in_recovery(scenario: Scenario, biped: Biped, limits: PlanLimits) -> PlanLimits:
    """The limits with what hips and knees leave to a disturbed walk."""
    gait, recovery = scenario.gait, scenario.mpc.recovery
    if recovery is None:
        return limits
    swing = math.floor(10.0 * swing_acceleration(biped, gait)) / 10.0
    changes = {"swing_acceleration": swing} if swing < recovery.swing_acceleration else {}
    return limits.model_copy(update={**changes, "zmp_held": held_zmp(biped, gait)})


def _cautious(scenario: Scenario, biped: Biped) -> tuple[Scenario, str]:
    """The gait that asks least of friction, and what it changes in words.

    The ZMP box is as wide as the soles and the feet are nearly as close as they may be, so that the CoM sways less;
    and the CoM stays level, so that the load is even.
    """
    gait, mpc = scenario.gait, scenario.mpc
    least = max(mpc.stance_width_min, 0.0 if mpc.recovery is None else mpc.recovery.stance_width_min)
    wider = 2.0 * min(float(biped.soles[side].half_size[1]) for side in SIDES)
    wanted = {
        "zmp_box": (gait.zmp_box[0], max(gait.zmp_box[1], wider)),
        "stance_width": min(gait.stance_width, round(_APART * least, 4)),
        "com_height_amplitude": 0.0,
    }
    changed = {key: value for key, value in wanted.items() if value != getattr(gait, key)}
    said = ", ".join(f"gait.{key} {value} instead of {getattr(gait, key)}" for key, value in changed.items())
    return _with(scenario, gait=changed), said


def _of_zmp(scenario: Scenario, limits: PlanLimits) -> np.ndarray:
    """Shares of the joints' torques (12,) that a ZMP at an edge of its box takes, of which a preview has nothing."""
    x, y = (side / 2.0 - scenario.mpc.zmp_margin for side in scenario.gait.zmp_box)
    shares = np.zeros((len(SIDES), len(ROLES)))
    for role, edge, rooms in (
        ("ankle_pitch", x, (limits.zmp_behind, limits.zmp_ahead)),
        ("ankle_roll", y, (limits.zmp_inward, limits.zmp_outward)),
    ):
        shares[:, ROLES.index(role)] = TORQUE * max(1.0 if room <= edge else edge / room for room in rooms)
    return shares.ravel()


def _is_near(biped: Biped, scenario: Scenario, limits: PlanLimits) -> bool:
    """Whether a limit may be exceeded, or a posture is out of reach."""
    if scenario.believed_friction < _SLIPPERY:
        return True
    seen = preview(biped, Step.of(scenario.gait))
    torques = seen.torques / biped.effort_limits + _of_zmp(scenario, limits)
    used = max(torques.max(), (seen.speeds / biped.velocity_limits).max())
    return bool(seen.missed) or bool(used > _FAR)
