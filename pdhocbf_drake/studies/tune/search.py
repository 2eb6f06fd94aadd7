"""A search along the parameters of a gait, with steps that get smaller."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.shared.gait_variants import AMPLITUDE, DOUBLE_SUPPORT, HEIGHT, PHASE, STEP_TICKS

STRIDE: Final = "stride"

_STEPS: Final = {PHASE: 0.1, HEIGHT: 0.03, AMPLITUDE: 0.006, DOUBLE_SUPPORT: 0.05, STEP_TICKS: 0.1, STRIDE: 0.1}
"""First step: shares of a step's ticks, of the CoM height twice, of a step's ticks, and of what is given twice."""

_SMALLEST = 0.25  # step over the first one
_MOST_ROUNDS = 12
_LONGEST_SUPPORT = 0.3  # double support over a step
_LARGEST_AMPLITUDE = 0.05  # over the CoM height
_TIMES = 0.6, 1.6  # of a step, over that of the scenario

Values = dict[str, Any]
Point = tuple[float, ...]


class Space(NamedTuple):
    """The parameters that are searched, as numbers of order one.

    Attributes:
        scenario: whose gait the search begins with.
        keys: of `gait`, in the order of a point.
    """

    scenario: Scenario
    keys: Sequence[str]

    @property
    def start(self) -> Point:
        """The scenario's own gait."""
        gait = self.scenario.gait
        phase = gait.ticks_per_step / 2 if gait.com_height_phase == "middle" else gait.com_height_phase
        own = {
            PHASE: phase / gait.ticks_per_step,
            HEIGHT: 1.0,
            AMPLITUDE: gait.com_height_amplitude / gait.com_height,
            DOUBLE_SUPPORT: gait.double_support_ticks / gait.ticks_per_step,
            STEP_TICKS: 1.0,
            STRIDE: 1.0,
        }
        return tuple(own[key] for key in self.keys)

    def around(self, point: Point, scale: float) -> list[Point]:
        """A step up and a step down along each parameter, as far as it may go."""
        found = []
        for i, key in enumerate(self.keys):
            low, high = self._range(key)
            for sign in (1.0, -1.0):
                value = point[i] + sign * scale * _STEPS[key]
                value = value % 1.0 if key == PHASE else min(max(value, low), high)
                found.append((*point[:i], value, *point[i + 1 :]))
        return found

    def values(self, point: Point) -> Values:
        """The keys of `gait` at a point, in whole ticks and tenths of millimetres."""
        gait, at = self.scenario.gait, dict(zip(self.keys, point, strict=True))
        ticks = round(gait.ticks_per_step * at.get(STEP_TICKS, 1.0))
        made: dict[str, Callable[[float], float]] = {
            PHASE: lambda share: round(share * ticks) % ticks,
            HEIGHT: lambda share: round(gait.com_height * share, 4),
            AMPLITUDE: lambda share: round(gait.com_height * share, 4),
            DOUBLE_SUPPORT: lambda share: round(share * ticks),
            STEP_TICKS: lambda share: ticks,
            STRIDE: lambda share: round(gait.stride * share, 4),
        }
        return {key: made[key](share) for key, share in at.items()}

    def _range(self, key: str) -> tuple[float, float]:
        if key == DOUBLE_SUPPORT:
            return 1.0 / self.scenario.gait.ticks_per_step, _LONGEST_SUPPORT
        if key == AMPLITUDE:
            return 0.0, _LARGEST_AMPLITUDE
        return _TIMES if key == STEP_TICKS else (0.0, math.inf)


def search(space: Space, costs: Callable[[list[Values]], list[float]]) -> list[tuple[float, Values]]:
    """Every gait that was tried, with its cost, the best one first.

    From the scenario's own gait, the search moves to the best of those one step along each parameter away, and of the
    one that takes all steps that help; where none is better, the steps are halved.

    Args:
        space: what is searched.
        costs: of several gaits, measured together.
    """
    known: dict[str, tuple[float, Values]] = {}

    def measured(points: list[Point]) -> list[float]:
        new = {str(values): values for values in map(space.values, points) if str(values) not in known}
        known.update(zip(new, zip(costs(list(new.values())), new.values(), strict=True), strict=True))
        return [known[str(space.values(point))][0] for point in points]

    here, scale = space.start, 1.0
    (best,) = measured([here])
    for _ in range(_MOST_ROUNDS):
        points = space.around(here, scale)
        found = measured(points)
        points.append(_together(here, points, found, best))
        found += measured(points[-1:])
        least = min(found)
        if least < best:
            here, best = points[found.index(least)], least
        elif scale > _SMALLEST:
            scale /= 2.0
        else:
            break
    return sorted(known.values(), key=lambda tried: tried[0])


def _together(here: Point, around: list[Point], costs: list[float], best: float) -> Point:
    """The point with the better of both steps along each parameter, where that is an improvement."""
    pairs = zip(zip(costs[::2], around[::2], strict=True), zip(costs[1::2], around[1::2], strict=True), strict=True)
    point = list(here)
    for i, pair in enumerate(pairs):
        cost, other = min(pair)
        if cost < best:
            point[i] = other[i]
    return tuple(point)
