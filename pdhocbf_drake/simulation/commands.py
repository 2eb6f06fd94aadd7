"""The gait of a scenario: a straight walk, or one that follows commands from a given place and heading."""

from __future__ import annotations

import math
from dataclasses import replace

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.command_limits import Limits
from pdhocbf_drake.walking.commanded_walk import CommandedFootsteps
from pdhocbf_drake.walking.commands import Command, Schedule
from pdhocbf_drake.walking.known_ground import KnownGround
from pdhocbf_drake.walking.sole_gap import Pose
from pdhocbf_drake.walking.uneven_footsteps import uneven_footsteps
from pdhocbf_drake.walking.waypoints import commands_along

_LEAST = 1e-3  # [m]: a stride of which a command can still be a share
_SHARE = 0.5  # of the legs' longest stride, up to which a walk is commanded


def commanded_gait(scenario: Scenario) -> Gait:
    """The gait of the `gait`, `start`, `commands` and `ground` keys.

    Raises:
        InputError: as `Gait` and `uneven_footsteps` do.
    """
    ground = known_ground(scenario)
    if ground is None:
        return _on_level_ground(scenario)
    if goes_ahead(scenario):
        return _prepared(Gait(scenario.gait, uneven_footsteps(scenario.gait, ground)))
    level = _on_level_ground(scenario)
    return _prepared(Gait(scenario.gait, replace(level.footsteps, known_ground=ground)))


def goes_ahead(scenario: Scenario) -> bool:
    """Whether it walks straight ahead along x from x = 0."""
    start = Pose(*scenario.start.position, scenario.start.yaw)
    return not scenario.path and not scenario.commands and start == Pose(0.0, 0.0, 0.0)


def _prepared(gait: Gait) -> Gait:
    """A gait on uneven ground whose swings are chosen."""
    for step in range(len(gait.footsteps.listed)):
        gait.profiles(step)
    return gait


def known_ground(scenario: Scenario) -> KnownGround | None:
    """The ground that the scenario's walk is planned on; None where its map is level.

    On the template the soles are as long as its ZMP box.
    """
    if not any(piece.known for piece in scenario.ground):
        return None
    half = scenario.gait.zmp_box[0] / 2.0
    if scenario.system == "biped":
        from pdhocbf_drake.robot import Biped  # here, since it loads Drake, which other walks need later
        from pdhocbf_drake.robot.contact import beyond_sole

        soles = [Biped.load(scenario.robot).soles[side].half_size for side in ("left", "right")]
        half = max(float(size[0]) + beyond_sole(size.tolist()) for size in soles)
    return KnownGround(scenario.terrain, half)


def _on_level_ground(scenario: Scenario) -> Gait:
    config, start = scenario.gait, Pose(*scenario.start.position, scenario.start.yaw)
    if scenario.path:
        along = _along_path(scenario, start)
        return Gait(config, CommandedFootsteps.of(config, along, start, limits_of(scenario), keeps_path=True))
    if goes_ahead(scenario):
        return Gait(config)
    if not scenario.commands:
        forward = Command(config.stride / (config.ticks_per_step * config.tick))
        ahead = CommandedFootsteps.of(config, lambda time: forward, start, Limits(stride=math.inf), keeps_path=True)
        end = None if config.walk_steps is None else config.start_steps + config.walk_steps - 1
        return Gait(config, ahead if end is None else ahead.ending_at(end))
    commands = [command.command for command in scenario.commands]
    schedule = Schedule([command.time for command in scenario.commands], commands)
    return Gait(config, CommandedFootsteps.of(config, schedule, start, limits_of(scenario)))


def _along_path(scenario: Scenario, start: Pose) -> Schedule:
    """The commands of a walk along the scenario's waypoints, one a step."""
    config, limits = scenario.gait, limits_of(scenario)
    duration = config.ticks_per_step * config.tick
    fastest = limits.stride / duration
    if scenario.path_speed > fastest:
        raise InputError(
            f"path_speed: must be at most {fastest:.3g} m/s, a step of {limits.stride:.3g} m in {duration:g} s "
            f"(given: {scenario.path_speed:g})"
        )
    steps = math.ceil(scenario.duration / duration)
    commands = commands_along(scenario.path, scenario.path_speed, start, limits, config, steps)
    return Schedule([i * duration for i in range(len(commands))], commands)


def limits_of(scenario: Scenario) -> Limits:
    """What the scenario's robot can be commanded; on the template there are no soles."""
    if scenario.system != "biped":
        return Limits()
    # Here, since it loads Drake, which other walks need later.
    from pdhocbf_drake.robot import Biped, longest_stride

    biped = Biped.load(scenario.robot)
    half = [min(biped.soles[side].half_size[i] for side in ("left", "right")) for i in (0, 1)]
    height = scenario.gait.com_height + scenario.gait.com_height_amplitude
    stride = _SHARE * longest_stride(biped, scenario.gait.stance_width, height)
    if (limits := scenario.mpc.plan_limits) is not None and limits.stride is not None:
        stride = min(stride, max(limits.stride, _LEAST))
    return Limits(stride, (float(half[0]), float(half[1])))


def commanded_stride(scenario: Scenario) -> float:
    """The longest stride that a walk straight ahead is commanded with [m]."""
    if not (scenario.commands or scenario.path):
        return scenario.gait.stride
    duration = scenario.gait.ticks_per_step * scenario.gait.tick
    speeds = [math.hypot(*command.velocity) for command in scenario.commands]
    speeds += [scenario.path_speed] if scenario.path else []
    return min(max(speeds) * duration, limits_of(scenario).stride)


def limited_commands(scenario: Scenario) -> list[str]:
    """A sentence for each command that is granted in part."""
    if not scenario.commands:
        return []
    limits, sentences = limits_of(scenario), list[str]()
    for command in scenario.commands:
        asked, granted = command.command, limits.granted(command.command, scenario.gait)
        if asked != granted:
            why = [f"the feet go {limits.stride:.3g} m in a step at most, half of it aside"] * (
                asked[:2] != granted[:2]
            )
            why += ["a foot turns by 0.3 rad in a step at most, less where soles would meet"] * (
                asked.turn != granted.turn
            )
            sentences.append(
                f"the command at {command.time:g} s is granted in part: velocity [{granted.forward:.3g}, "
                f"{granted.lateral:.3g}] m/s and turn {granted.turn:.3g} rad/s of [{asked.forward:g}, "
                f"{asked.lateral:g}] m/s and {asked.turn:g} rad/s: {', and '.join(why)}"
            )
    return sentences
