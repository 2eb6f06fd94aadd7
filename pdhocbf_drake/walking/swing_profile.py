"""When a swing foot goes ahead and up in its swing, so that it clears the edges of steps."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

_WAITS = 0.0, 0.1, 0.2, 0.3  # shares of the swing
_EARLY = 0.0, 0.1, 0.2, 0.3
_CHANGES = (0.0, 1.0), (0.0, 0.8), (0.0, 0.7), (0.0, 0.6), (0.2, 1.0), (0.3, 1.0), (0.4, 1.0), (0.5, 1.0)
_APEXES = 1.0, 1.3, 1.6  # over the usual clearance


class Timing(NamedTuple):
    """Of a swing: its duration [ticks] and the tick [s]."""

    ticks: int
    tick: float


class SwingProfile(NamedTuple):
    """The timing of a swing, which the reference of the foot and the forecast of what it does to the ZMP both follow.

    Attributes:
        wait: ticks after lift-off in which the foot goes up, and not yet along x.
        early: ticks before touchdown at which it has come to where it lands along x.
        change: the shares of the swing at which its ground begins and ends to be that of the next foothold.
        apex: clearance over that ground at mid-swing [m].
    """

    wait: int = 0
    early: int = 0
    change: tuple[float, float] = (0.0, 1.0)
    apex: float = 0.05

    def shares(self, timing: Timing) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the way along x, and of the change of ground, at each tick of a swing; and its clearance [m]."""
        ticks = np.arange(timing.ticks + 1)
        s, (begin, end) = ticks / timing.ticks, self.change
        ahead = _blend((ticks - self.wait) / (timing.ticks - self.wait - self.early))
        return ahead, _blend((s - begin) / (end - begin)), 64.0 * self.apex * (s * (1.0 - s)) ** 3


def candidates(timing: Timing, apex: float) -> Iterator[SwingProfile]:
    """Profiles, the gentlest first: those whose foot hurries least, and is lifted least."""
    all_of_them = product(_WAITS, _EARLY, _CHANGES, _APEXES)

    def effort(shares: tuple[float, float, tuple[float, float], float]) -> float:
        wait, early, (begin, end), lift = shares
        return (1.0 - wait - early) ** -2 + 0.5 * (end - begin) ** -2 + 2.0 * (lift - 1.0)

    for wait, early, change, lift in sorted(all_of_them, key=effort):
        yield SwingProfile(round(wait * timing.ticks), round(early * timing.ticks), change, lift * apex)


def _blend(s: np.ndarray) -> np.ndarray:
    s = np.clip(s, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 + s * (-15.0 + 6.0 * s)))


@lru_cache(maxsize=64)
def whole_swing(period: int, begin: int, ticks: int, tick: float) -> np.ndarray:
    """Acceleration of a least-jerk motion by one metre, from rest to rest, at each tick of a step, (N,) [1/s²].

    Args:
        begin: the tick of the step at which it begins. ticks: how long it takes.
    """
    s = np.clip((np.arange(period) - begin) / ticks, 0.0, 1.0)
    return np.asarray(60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (ticks * tick) ** 2)


def change_of_ground(change: tuple[float, float], duration: float, time: float) -> tuple[float, float, float]:
    """Share of the next foothold's ground `time` after lift-off, and its derivatives [1, 1/s, 1/s²].

    10s³ − 15s⁴ + 6s⁵ over the part `change` of a swing of `duration` [s].
    """
    begin, length = change[0] * duration, (change[1] - change[0]) * duration
    s = min(max((time - begin) / length, 0.0), 1.0)
    r = s * (1.0 - s)
    return (
        s**3 * (10.0 + s * (-15.0 + 6.0 * s)),
        30.0 * r**2 / length,
        60.0 * r * (1.0 - 2.0 * s) / length**2,
    )
