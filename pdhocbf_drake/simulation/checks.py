"""Checks of a scenario's values against each other; and the keys that its system does not use."""

from __future__ import annotations

import math
from itertools import pairwise
from operator import attrgetter
from typing import Any, Final

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.ground_checks import check_ground
from pdhocbf_drake.simulation.scenario import Push, Scenario, System
from pdhocbf_drake.systems.signals import JOINTS
from pdhocbf_drake.walking.com_height import GRAVITY

_LONGEST_STEP = 10.0  # [s]
_LARGEST_GROWTH = 100.0  # of ω·H·δ; e^709 is the largest double
_MOST_STEPS = 1000  # of the plant in a tick
_MOST_ENTRIES = 4e7  # of the H x H matrices of all phases, at fifty bytes an entry

# Keys that a system does not read; "pushes.body" is that of each push.
_UNUSED: Final[dict[System, tuple[str, ...]]] = {
    "biped": ("vhip", "van_der_pol"),
    "vhip": (
        "robot", "biped", "ground", "friction", "friction_belief", "plant", "model_error", "gait.swing_height",
        "pushes.body", "van_der_pol",
        "measurement.source", "measurement.drives", "measurement.seed", "measurement.imu", "measurement.encoders",
        "measurement.force_torque", "measurement.estimator", "measurement.faults",
    ),
    "van_der_pol": (
        "robot", "biped", "ground", "friction", "friction_belief", "plant", "model_error", "measurement", "gait",
        "mpc", "barriers", "barrier_changes", "pushes", "wind", "vhip", "start", "commands", "path", "path_speed",
    ),
}  # fmt: skip


def check_scenario(scenario: Scenario) -> None:
    """Raises `InputError` for values that are valid each by itself, but contradict each other."""
    if scenario.duration < scenario.tick * (1.0 - 1e-9):
        _refuse("duration", f"must be at least a tick of {scenario.tick:g} s", scenario.duration)
    if scenario.system == "van_der_pol":
        return
    _check_size(scenario)
    _check_delay(scenario)
    _check_lengths(scenario)
    _check_commands(scenario)
    for index, push in enumerate(scenario.pushes):
        _check_push(f"pushes.{index}", push, scenario)
    if scenario.system == "biped":
        check_ground(scenario)
        _check_plant(scenario)
        _check_drives(scenario)


def check_straight(scenario: Scenario) -> None:
    """Raises `InputError` for a walk that follows commands, where only a straight one can be judged."""
    for key in ("commands", "path"):
        if getattr(scenario, key):
            _refuse(key, "must be empty here, where the walk straight ahead at gait.stride is judged", scenario.name)


def check_watchable(scenario: Scenario) -> None:
    """Raises `InputError` for a scenario without a robot, which Meshcat can't show."""
    if scenario.system != "biped":
        raise InputError(f"only a robot can be watched live; {scenario.name} is a template, whose replay shows it")


def unused_settings(scenario: Scenario) -> list[str]:
    """Keys with another value than their default that the scenario's system does not use."""
    default = Scenario(system=scenario.system)
    return [key for key in _UNUSED[scenario.system] if _value(scenario, key) != _value(default, key)]


def _value(scenario: Scenario, key: str) -> Any:
    if key == "pushes.body":
        return [push.body for push in scenario.pushes if push.body is not None]
    return attrgetter(key)(scenario)


def _check_size(scenario: Scenario) -> None:
    gait, horizon = scenario.gait, scenario.mpc.horizon
    if gait.ticks_per_step * gait.tick > _LONGEST_STEP:
        step = f"{gait.ticks_per_step} ticks of {gait.tick:g} s"
        _refuse("gait.ticks_per_step", f"a step may last {_LONGEST_STEP:g} s at most", step)
    # The controller refuses a horizon that violates Lemma 2.
    if horizon % gait.ticks_per_gait == 0 and gait.ticks_per_step * horizon**2 > _MOST_ENTRIES:
        longest = int((_MOST_ENTRIES / gait.ticks_per_step) ** 0.5) // gait.ticks_per_gait * gait.ticks_per_gait
        allowed = f"{longest} ticks at most" if longest else "fewer ticks per step, since one gait is too much already"
        _refuse("mpc.horizon", f"too much memory is needed for it; allowed is {allowed}", horizon)
    growth = (GRAVITY / gait.com_height) ** 0.5 * horizon * gait.tick
    if growth > _LARGEST_GROWTH:
        allowed = f"too low for a horizon of {horizon * gait.tick:g} s, in which a fall grows by e^{growth:.0f}"
        _refuse("gait.com_height", allowed, gait.com_height)


def _check_delay(scenario: Scenario) -> None:
    delay, horizon = scenario.mpc.delay, scenario.mpc.horizon
    key, allowed = "mpc.delay", f"must be at most mpc.horizon, {horizon} ticks"
    if delay == "auto":
        key, delay = "measurement.delay_ticks", scenario.measurement.late_ticks
        allowed += ", or mpc.delay must be a number: what is measured is carried forward by as much"
    if delay > horizon:
        _refuse(key, allowed, delay)


def _check_lengths(scenario: Scenario) -> None:
    gait, mpc = scenario.gait, scenario.mpc
    recovery_box = None if mpc.recovery is None else mpc.recovery.zmp_box
    for key, box in (("gait.zmp_box", gait.zmp_box), ("mpc.recovery.zmp_box", recovery_box)):
        if box is not None and 2.0 * mpc.zmp_margin >= min(box):
            _refuse("mpc.zmp_margin", f"must be below half of {key}, {min(box) / 2.0:g} m", mpc.zmp_margin)
    width, least = gait.stance_width, mpc.stance_width_min
    if width < least:
        _refuse("gait.stance_width", f"must be at least mpc.stance_width_min, {least:g} m", width)
    lengths = {"gait.stride": abs(gait.stride), "gait.stance_width": width}
    if scenario.system == "vhip" and lengths["gait.stride"] > 2.0 * gait.com_height:
        longest = f"{2.0 * gait.com_height:g} m, twice gait.com_height: in a longer step it leans by more than 45°"
        _refuse("gait.stride", f"must be at most {longest}", gait.stride)
    limits = mpc.plan_limits
    limited = None if limits is None else limits.step_reach
    for where, reaches in (("mpc.step_reach", mpc.step_reach), ("mpc.limits.step_reach", limited)):
        for (key, length), reach in zip(lengths.items(), reaches or (math.inf, math.inf), strict=True):
            if length > reach:
                _refuse(key, f"must be within {where}, {reach:g} m", length)
    if limits is not None:
        if len(limits.zmp_held) not in (0, gait.ticks_per_step):
            allowed = f"must have an entry for each of the {gait.ticks_per_step} ticks of a step, or none"
            _refuse("mpc.limits.zmp_held", allowed, len(limits.zmp_held))
        rooms = (limits.zmp_behind, limits.zmp_ahead), (limits.zmp_inward, limits.zmp_outward)
        for axis, middle, side, (low, high) in zip("xy", limits.zmp_middle, gait.zmp_box, rooms, strict=True):
            if middle - side / 2.0 >= high or middle + side / 2.0 <= -low:
                allowed = f"the ZMP box of {side:g} m must reach to where the ZMP may lie, from {-low:g} to {high:g} m"
                _refuse(f"mpc.limits.zmp_middle in {axis}", allowed, middle)


def _check_commands(scenario: Scenario) -> None:
    for index, (one, other) in enumerate(pairwise(scenario.commands), start=1):
        if other.time <= one.time:
            allowed = f"must be later than that of the command before, {one.time:g} s"
            _refuse(f"commands.{index}.time", allowed, other.time)
    if scenario.path and scenario.commands:
        _refuse("path", "must be empty where there are commands", f"{len(scenario.path)} waypoints")
    if not scenario.path and scenario.path_speed != Scenario.model_fields["path_speed"].default:
        _refuse("path_speed", "is the speed along a path, and there is none", scenario.path_speed)
    if not scenario.commands and not scenario.path:
        return
    if scenario.gait.walk_steps is not None:
        allowed = "must be null where there are commands or a path, which end the walk"
        _refuse("gait.walk_steps", allowed, scenario.gait.walk_steps)
    if scenario.mpc.terminal_set is not None:
        allowed = "must be null where there are commands or a path, since it is the set of a straight walk"
        _refuse("mpc.terminal_set", allowed, scenario.mpc.terminal_set)


def _check_push(where: str, push: Push, scenario: Scenario) -> None:
    gait = scenario.gait
    if push.phase >= gait.ticks_per_gait:
        _refuse(f"{where}.phase", f"must be below the {gait.ticks_per_gait} ticks of a gait", push.phase)
    if push.time is not None and push.phase:
        _refuse(f"{where}.phase", "belongs to a push at a step, not to one at a time", push.phase)


def _check_plant(scenario: Scenario) -> None:
    step, tick = float(scenario.plant["time_step"]), scenario.gait.tick
    steps = tick / step if step > 0 else 0.0
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-6:
        _refuse("plant.time_step", f"must divide gait.tick, {tick:g} s, into whole parts", step)
    if steps > _MOST_STEPS:
        _refuse("plant.time_step", f"must be at least {tick / _MOST_STEPS:g} s, a thousandth of gait.tick", step)


def _check_drives(scenario: Scenario) -> None:
    measurement = scenario.measurement
    if measurement.drives != "sampled":
        return
    if measurement.source != "sensors":
        allowed = "sampled needs measurement.source: sensors, whose encoders the drives then read"
        _refuse("measurement.drives", allowed, f"source {measurement.source}")
    for index, fault in enumerate(measurement.faults):
        if fault.sensor == "encoders" or fault.sensor in JOINTS:
            allowed = "an encoder can't fail where measurement.drives is sampled, since its joint would have no target"
            _refuse(f"measurement.faults.{index}.sensor", allowed, fault.sensor)


def _refuse(key: str, allowed: str, given: Any) -> None:
    raise InputError(f"{key}: {allowed} (given: {given})")
