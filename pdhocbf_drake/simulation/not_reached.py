"""What a scenario has after the end of its run, or farther away than its walk comes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import accumulate, pairwise

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario import Scenario

_SOLE = 0.15  # of a foot beyond its place, at most [m]


def not_reached(scenario: Scenario) -> list[str]:
    """Sentences on what comes after the end of the run, and on waypoints and ground that the walk does not come to."""
    if scenario.system == "van_der_pol":
        return []
    sentences = []
    if late := [f"{key} at {time:g} s" for key, time in _times(scenario) if time >= scenario.duration]:
        sentences.append(f"the run ends at {scenario.duration:g} s, before {', '.join(late)}")
    if scenario.path:
        along, farthest = _along_path(scenario), scenario.path_speed * scenario.duration
        if beyond := [f"path.{i}, {way:.3g} m along it" for i, way in enumerate(along) if way > farthest + _SOLE]:
            sentences.append(f"the walk comes {farthest:.3g} m along its path, not to {', '.join(beyond)}")
    if scenario.system == "biped" and scenario.ground:
        way, start = _way(scenario), scenario.start.position[0]
        spans = [(f"ground.{i}", *piece.span()) for i, piece in enumerate(scenario.ground)]
        far = [(key, max(low - start, start - high)) for key, low, high in spans]
        if beyond := [f"{key}, {distance:.3g} m away" for key, distance in far if distance > way + _SOLE]:
            sentences.append(f"the walk comes {way:.3g} m from its start, not to {', '.join(beyond)}")
    return sentences


def check_pushed(scenario: Scenario) -> None:
    """Raises `InputError` for a push after the end, where a run would count as one that survived it."""
    for key, time in _times(scenario):
        if key.startswith("pushes") and time >= scenario.duration:
            raise InputError(
                f"{key}: must start before the run ends at {scenario.duration:g} s (given: a start at {time:g} s)"
            )


def _times(scenario: Scenario) -> Iterator[tuple[str, float]]:
    """Keys of all that starts at a time, and the times [s]."""
    gait = scenario.gait
    if gait.walk_steps:
        yield "the end of gait.walk_steps", (gait.start_steps + gait.walk_steps) * gait.ticks_per_step * gait.tick
    yield from ((f"commands.{i}", command.time) for i, command in enumerate(scenario.commands))
    yield from ((f"barrier_changes.{i}", change.time) for i, change in enumerate(scenario.barrier_changes))
    yield from ((f"pushes.{i}", push.start(gait)) for i, push in enumerate(scenario.pushes))
    if scenario.system == "biped" and scenario.measurement.source == "sensors":
        faults = scenario.measurement.faults
        yield from ((f"measurement.faults.{i}", fault.time) for i, fault in enumerate(faults))


def _along_path(scenario: Scenario) -> list[float]:
    """Length of the path up to each waypoint [m]."""
    points = [scenario.start.position, *scenario.path]
    return list(accumulate(math.dist(one, other) for one, other in pairwise(points)))


def _way(scenario: Scenario) -> float:
    """The farthest that a foot is put down from the start, at most [m]."""
    from pdhocbf_drake.simulation.commands import goes_ahead, known_ground  # here, since it loads Drake
    from pdhocbf_drake.walking.uneven_footsteps import uneven_footsteps

    gait = scenario.gait
    step = gait.ticks_per_step * gait.tick
    if goes_ahead(scenario) and (ground := known_ground(scenario)) is not None:
        listed = uneven_footsteps(gait, ground).listed
        last, rest = listed[-1], scenario.duration - listed[-1].start * gait.tick
        within = [footstep.x for footstep in listed if footstep.start * gait.tick <= scenario.duration]
        return last.x + gait.stride * math.ceil(rest / step) if rest > 0.0 else max(within)
    if scenario.path:
        return scenario.path_speed * scenario.duration
    if scenario.commands:
        times = [min(command.time, scenario.duration) for command in scenario.commands]
        lengths = [end - begin for begin, end in zip(times, [*times[1:], scenario.duration], strict=True)]
        speeds = [math.hypot(*command.velocity) for command in scenario.commands]
        return sum(speed * length for speed, length in zip(speeds, lengths, strict=True)) + max(speeds) * step
    steps = max(math.ceil(scenario.duration / step) - gait.start_steps, 0)
    return abs(gait.stride) * (steps if gait.walk_steps is None else min(steps, gait.walk_steps))
