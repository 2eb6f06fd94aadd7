"""Footsteps of a straight walk over uneven ground: onto each tread, and evenly between them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.footsteps import Footstep, Footsteps, commanded_footsteps
from pdhocbf_drake.walking.known_ground import ROOM, KnownGround

_FROM_EDGE = 0.015  # how far inside the window of a long surface the first and the last foot on it stand [m]
_FAR = 1e3  # a surface that ends beyond goes on for ever [m]
_MOST = 10_000  # steps
_ROUNDED = 1e-9  # [m]


def uneven_footsteps(config: GaitConfig, ground: KnownGround) -> Footsteps:
    """The footsteps that the `gait` keys describe, over ground that is not level.

    One foot stands in the middle of each surface that is too short for a stride, and on each stone. On a longer one the
    steps are of equal length, `gait.stride` at most. After the last surface they are `gait.stride` long. Where left and
    right foot have surfaces of their own, each lands in its window that is nearest to a stride ahead.

    Raises:
        InputError: the stride is not positive, a surface is shorter than the soles, or there is no end of them.
    """
    level = commanded_footsteps(config)
    if config.stride <= 0.0:
        raise InputError(
            f"gait.stride: over uneven ground a walk goes ahead, with a positive stride (given: {config.stride})"
        )
    start = config.start_steps + 1
    stand, first = level.listed[:start], level.listed[start]
    listed, before = list(stand), first._replace(x=0.0)
    for x, y in _places(config, ground, first):
        side = first.side * (-1) ** (len(listed) - start)
        listed.append(Footstep(side, x, y, 0.0, 0.0, before.start + (len(listed) - start) * before.ticks, before.ticks))
    return Footsteps(tuple(listed), (2.0 * config.stride, 0.0), config.stance_width, level.last, known_ground=ground)


def _places(config: GaitConfig, ground: KnownGround, first: Footstep) -> Iterator[tuple[float, float]]:
    """x and y of each stance from the first swing's on, until the ground is level for ever."""
    half, side, x = config.stance_width / 2.0, first.side, 0.0
    rest = list(ground.stones)
    yield x, side * half
    for _ in range(_MOST):
        stones = rest[0].places if rest else ()
        common = _common(ground, x, half, rest[0].start if rest else math.inf)
        if common is None:
            side, x = -side, _ahead(ground, x, -side * half, config.stride)
            yield x, side * half
            continue
        low, high = common
        goal = high - _FROM_EDGE if high - low > config.stride else x
        if not stones or high + ground.half + ROOM < rest[0].start - _ROUNDED:
            stones = ()
        elif stones[0][0] <= high + 2.0 * ground.half:
            goal = stones[0][0] - config.stride
        if high > _FAR and not stones:
            for _ in range(2):
                side, x = -side, x + config.stride
                yield x, side * half
            return
        count = math.ceil(max(goal - x, 0.0) / config.stride - 1e-9)
        if stones and (side * (-1) ** (count + 1)) * stones[0][1] < 0.0:
            count += 1  # so that the foot of the first stone's side comes to it
        step = (goal - x) / count if count else 0.0
        for _ in range(count):
            side, x = -side, x + step
            yield x, side * half
        for x, y in stones:
            side = -side
            yield x, y
        rest = rest[1:] if stones else rest
        low, high = _long_enough(ground, _next(ground, x, -side * half, config.stride))
        side, x = -side, _onto(low, high, config.stride)
        yield x, side * half
    raise InputError(f"ground: a walk over it takes more than {_MOST} steps")


def _common(ground: KnownGround, x: float, half: float, blocks: float) -> tuple[float, float] | None:
    """The window of both feet at x, where they are on one plane up to its end; None where each has its own.

    Blocks may be on a level with the ground before and behind them, which then goes on for one foot.

    Args:
        half: of the feet's distance [m]. blocks: where they begin, x [m].
    """
    left, right = (ground.under(x, y) for y in (half, -half))
    low, high = max(left.window[0], right.window[0]), min(left.window[1], right.window[1])
    end = left.window[1] == right.window[1] or abs(high + ground.half + ROOM - blocks) < _ROUNDED
    same = (left.height, left.slope) == (right.height, right.slope) and end and low <= x
    return (low, high) if left.window == right.window or same else None


def _next(ground: KnownGround, x: float, y: float, stride: float) -> tuple[float, float]:
    """The window on the surface that the foot beside x, at y, comes to: the next one, or the one a stride ahead."""
    windows = ground.next_surface(x, y), ground.under(x + stride, y).window
    return min((window for window in windows if window[0] > x), default=windows[0])


def _ahead(ground: KnownGround, x: float, y: float, stride: float) -> float:
    """Where the foot at y lands that is to be a stride ahead of x, but not on an edge [m]."""
    low, high = ground.under(x + stride, y).window
    if low > high or high <= x:
        low, high = _long_enough(ground, ground.next_surface(x + stride, y))
    inside = min(_FROM_EDGE, 0.5 * (high - low))
    return min(max(x + stride, low + inside), high - inside)


def _long_enough(ground: KnownGround, window: tuple[float, float]) -> tuple[float, float]:
    """The window; raises `InputError` where its surface is too short for the soles."""
    low, high = window
    if low > high + _ROUNDED:
        needed = 2.0 * (ground.half + ROOM)
        raise InputError(
            f"ground: the surface from x = {low - needed / 2.0:.3g} m on is {high - low + needed:.4g} m long, and "
            f"soles need {needed:.3g} m"
        )
    return window


def _onto(low: float, high: float, stride: float) -> float:
    """Where the first foot on a surface stands, by the window on it [m]."""
    return 0.5 * (low + high) if high - low <= stride else low + _FROM_EDGE
