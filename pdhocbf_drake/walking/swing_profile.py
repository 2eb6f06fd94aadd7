"""When a swing foot goes ahead and up in its swing, so that it clears the edges of steps."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

_WAITS = 0.0, 0.1, 0.2, 0.3  # shares of the swing
_EARLY = 0.0, 0.05, 0.1, 0.2, 0.3
_CHANGES = (0.0, 1.0), (0.0, 0.8), (0.0, 0.7), (0.0, 0.6), (0.2, 1.0), (0.3, 1.0), (0.4, 1.0), (0.5, 1.0)
_LIFTS = (1.0, None), (1.0, 0.45), (1.0, 0.35), (1.4, 0.45), (1.4, 0.35), (1.8, 0.35)  # apex over the usual one, ramp
_UP = 0.4  # what an acceleration upwards costs over one ahead, which the ground carries with a lever
_BUMP = 4.2  # largest acceleration of the usual clearance over that of a least-jerk motion as high in as much time


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
        ramp: the share of the swing in which it rises to that, and in which it falls again; None for 64 s³(1 − s)³.
    """

    wait: int = 0
    early: int = 0
    change: tuple[float, float] = (0.0, 1.0)
    apex: float = 0.05
    ramp: float | None = None

    def clearance(self, s: float) -> tuple[float, float, float]:
        """Over the ground at a share s of the swing, and its derivatives by s [m]."""
        s = min(max(s, 0.0), 1.0)
        if self.ramp is None:
            r, slope = s * (1.0 - s), 1.0 - 2.0 * s
            bump = r**3, 3.0 * r**2 * slope, 6.0 * r * slope**2 - 6.0 * r**2
            return 64.0 * self.apex * bump[0], 64.0 * self.apex * bump[1], 64.0 * self.apex * bump[2]
        up, down = least_jerk_step(s / self.ramp), least_jerk_step((1.0 - s) / self.ramp)
        return (
            self.apex * up[0] * down[0],
            self.apex * (up[1] * down[0] - up[0] * down[1]) / self.ramp,
            self.apex * (up[2] * down[0] - 2.0 * up[1] * down[1] + up[0] * down[2]) / self.ramp**2,
        )

    def shares(self, timing: Timing) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the way along x, and of the change of ground, at each tick of a swing; and its clearance [m]."""
        ticks = timing.ticks
        return (
            _moved(ticks, self.wait / ticks, 1.0 - self.early / ticks),
            _moved(ticks, *self.change),
            self.apex * _lifted(ticks, self.ramp),
        )


@lru_cache(maxsize=256)
def _moved(ticks: int, begin: float, end: float) -> np.ndarray:
    """The least-jerk step over a part of a swing, at each of its ticks."""
    return np.array([least_jerk_step((i / ticks - begin) / (end - begin))[0] for i in range(ticks + 1)])


@lru_cache(maxsize=64)
def _lifted(ticks: int, ramp: float | None) -> np.ndarray:
    """The clearance of a swing with an apex of 1, at each of its ticks."""
    return np.array([SwingProfile(apex=1.0, ramp=ramp).clearance(i / ticks)[0] for i in range(ticks + 1)])


def candidates(timing: Timing, apex: float, way: float, rise: float) -> Iterator[SwingProfile]:
    """Profiles, the one with the least accelerations first.

    Args:
        apex: usual clearance [m]. way, rise: along x and upwards [m].
    """

    def effort(kind: tuple[float, float, tuple[float, float], tuple[float, float | None]]) -> float:
        wait, early, (begin, end), (lift, ramp) = kind
        up = abs(rise) / (end - begin) ** 2 + lift * apex * (_BUMP if ramp is None else 1.0 / ramp**2)
        return abs(way) / (1.0 - wait - early) ** 2 + _UP * up

    for wait, early, change, (lift, ramp) in sorted(product(_WAITS, _EARLY, _CHANGES, _LIFTS), key=effort):
        yield SwingProfile(round(wait * timing.ticks), round(early * timing.ticks), change, lift * apex, ramp)


def least_jerk_step(s: float) -> tuple[float, float, float]:
    """10s³ − 15s⁴ + 6s⁵ and its derivatives, for s cut to [0, 1]: from 0 to 1 from rest to rest."""
    s = min(max(s, 0.0), 1.0)
    r = s * (1.0 - s)
    return s**3 * (10.0 + s * (-15.0 + 6.0 * s)), 30.0 * r**2, 60.0 * r * (1.0 - 2.0 * s)


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

    The least-jerk step over the part `change` of a swing of `duration` [s].
    """
    begin, length = change[0] * duration, (change[1] - change[0]) * duration
    share, rate, more = least_jerk_step((time - begin) / length)
    return share, rate / length, more / length**2
