"""Commands that lead a walk along waypoints: along the lines between them, turning on the spot at corners."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.walking.command_limits import Limits
from pdhocbf_drake.walking.commands import STOP, Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.sole_gap import Pose
from pdhocbf_drake.walking.walker import Walker

Array = NDArray[np.float64]

_CORNER = 0.35  # [rad]: between two lines that turn by more, the walk turns on the spot
_ASTRAY = 0.3  # [rad]: likewise where the heading is off by more
_AHEAD = 0.25  # of the point that the walk heads for, along the path [m]
_TURN = 0.5  # [rad/s]
_ARRIVED = 0.01  # [m]
_LEAST = 0.01  # of the last step towards the end of a stretch [m]


def commands_along(
    points: Sequence[tuple[float, float]], speed: float, start: Pose, limits: Limits, config: GaitConfig, steps: int
) -> list[Command]:
    """The command of each step from a stand at `start` along the waypoints, ending with a stop; at most `steps`.

    Args:
        points: waypoints in the world [m].
        speed: along the path [m/s].
    """
    walker = Walker(config)
    stage = walker.after(walker.standing(start), STOP)
    commands: list[Command] = []
    for line in _stretches([(start.x, start.y), *points]):
        done = 0.0
        while len(commands) < steps:
            at, done = _nearest(line, (stage.path.x, stage.path.y), done)
            left = _length(line) - at
            if left < _ARRIVED:
                break
            command = limits.granted(_towards(line, at, left, stage.path, speed, config), config)
            commands.append(command)
            stage = walker.after(stage, command)
    return [*commands, Command(), STOP]


def distance_to(points: Sequence[tuple[float, float]], places: Array) -> Array:
    """Distance of places (T, 2) from the lines between the waypoints, (T,) [m]."""
    line = np.asarray(points, dtype=float)
    least = np.linalg.norm(places - line[0], axis=1)
    for one, other in pairwise(line):
        way = other - one
        share = np.clip((places - one) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        least = np.minimum(least, np.linalg.norm(places - one - share[:, None] * way, axis=1))
    return np.asarray(least)


def _towards(line: Array, at: float, left: float, here: Pose, speed: float, config: GaitConfig) -> Command:
    """The command of one step towards the point of the path that is `_AHEAD` of the nearest one."""
    duration = config.ticks_per_step * config.tick
    x, y = _point(line, at + _AHEAD)
    off = math.remainder(math.atan2(y - here.y, x - here.x) - here.yaw, math.tau)
    if abs(off) > _ASTRAY:
        return Command(turn=math.copysign(min(abs(off) / duration, _TURN), off))
    forward = min(speed, max(left, _LEAST) / duration)
    turn = off / max(_AHEAD / max(forward, 1e-3), 2.0 * duration) * 2.0
    return Command(forward, 0.0, min(max(turn, -_TURN), _TURN))


def _stretches(points: Sequence[tuple[float, float]]) -> list[Array]:
    """The path cut at its corners, without lines of no length."""
    kept = [points[0]]
    for point in points[1:]:
        if math.dist(point, kept[-1]) > _ARRIVED:
            kept.append(point)
    if len(kept) < 2:
        return []
    stretches = [[kept[0], kept[1]]]
    for point in kept[2:]:
        (x0, y0), (x1, y1) = stretches[-1][-2:]
        turn = math.atan2(point[1] - y1, point[0] - x1) - math.atan2(y1 - y0, x1 - x0)
        if abs(math.remainder(turn, math.tau)) > _CORNER:
            stretches.append([(x1, y1), point])
        else:
            stretches[-1].append(point)
    return [np.array(stretch) for stretch in stretches]


def _lengths(line: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


def _length(line: Array) -> float:
    return float(_lengths(line)[-1])


def _point(line: Array, at: float) -> tuple[float, float]:
    """The point so far along the line; beyond its end straight on [m]."""
    lengths = _lengths(line)
    part = min(max(int(np.searchsorted(lengths, at)) - 1, 0), len(line) - 2)
    share = (at - lengths[part]) / (lengths[part + 1] - lengths[part])
    x, y = (line[part] + share * (line[part + 1] - line[part])).tolist()
    return x, y


def _nearest(line: Array, place: tuple[float, float], done: float) -> tuple[float, float]:
    """How far along the line its point nearest to a place is, straight on beyond the end, and no less than `done`."""
    lengths, best, least = _lengths(line), done, math.inf
    for part in range(len(line) - 1):
        way = line[part + 1] - line[part]
        length = lengths[part + 1] - lengths[part]
        most = math.inf if part == len(line) - 2 else length
        share = min(max(float((np.array(place) - line[part]) @ way) / length, 0.0), most)
        at = lengths[part] + share
        apart = math.dist(place, _point(line, at))
        if at >= done and apart < least and at - done < 4.0 * _AHEAD:
            best, least = at, apart
    return best, min(max(best, done), float(lengths[-1]))
