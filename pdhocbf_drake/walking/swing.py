"""The swing foot: minimum jerk along the ground, a smooth bump above it, and its accelerations over the horizon."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.walking.gait import Gait
from pdhocbf_drake.walking.kernels import add_accelerations, write_feet
from pdhocbf_drake.walking.swing_profile import SwingProfile, change_of_ground, whole_swing


class SwingPoint(NamedTuple):
    """A point of the swing: position [m], velocity [m/s], acceleration [m/s²], each of shape (3,)."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def swing_point(start: np.ndarray, end: np.ndarray, height: float, duration: float, time: float) -> SwingPoint:
    """The swing sole at `time` of `duration` seconds, from `start` to `end`, shape (2,) or (3,) [m].

    With s = time/duration ∈ [0, 1]: x and y follow 10s³ − 15s⁴ + 6s⁵, z follows 64 height s³(1 − s)³, so that
    velocity and acceleration vanish at both ends and z is `height` at s = 1/2. Outside [0, 1] the foot rests.
    """
    s = min(max(time / duration, 0.0), 1.0)
    rate = 1.0 / duration
    blend = s**3 * (10.0 + s * (-15.0 + 6.0 * s))
    blend_v = 30.0 * s**2 * (1.0 - s) ** 2 * rate
    blend_a = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) * rate**2
    r = s * (1.0 - s)
    r_v = (1.0 - 2.0 * s) * rate
    lift = 64.0 * height * r**3
    lift_v = 192.0 * height * r**2 * r_v
    lift_a = 192.0 * height * (2.0 * r * r_v**2 - 2.0 * r**2 * rate**2)
    move = np.zeros(3)
    move[: len(end)] = np.asarray(end) - np.asarray(start)
    base = np.zeros(3)
    base[: len(start)] = start
    up = np.array([0.0, 0.0, 1.0])
    return SwingPoint(base + blend * move + lift * up, blend_v * move + lift_v * up, blend_a * move + lift_a * up)


class Swing:
    """Reference motion of both soles at each tick, and accelerations of the swing foot over the horizon.

    The landing may move at every tick. From its last reference the swing foot takes the path of least jerk to the
    present landing; its height depends on the time since lift-off alone, and its clearance on the square of the time
    that the swing takes, so that a short swing is no more violent. When it goes is said by the `SwingProfile` of the
    step, on uneven ground another one for each step.
    """

    def __init__(self, gait: Gait) -> None:
        config = gait.config
        self._usual = SwingProfile(apex=config.swing_height)
        self._timing = gait.period, config.double_support_ticks, gait.swing_ticks(), config.tick
        self._above = lru_cache(maxsize=16)(self._heights)
        self._whole = lru_cache(maxsize=16)(self._accelerations)

    def _heights(self, lift_off: int, apex: float, ramp: float | None) -> np.ndarray:
        """Height of the swing sole and its derivatives at each tick of a step, (N + 1, 3) [m, m/s, m/s²]."""
        period, _, usual, delta = self._timing
        ground, duration = np.zeros(2), (period - lift_off) * delta
        height, times = apex * (duration / (usual * delta)) ** 2, [(q - lift_off) * delta for q in range(period + 1)]
        if ramp is None:
            points = [swing_point(ground, ground, height, duration, time) for time in times]
            return np.array([[part[2] for part in point] for point in points])
        lift, units = SwingProfile(apex=height, ramp=ramp), duration ** -np.arange(3.0)
        return np.array([lift.clearance(time / duration) for time in times]) * units

    def _accelerations(self, profiles: tuple[SwingProfile, ...]) -> np.ndarray:
        """`whole` of the kernel, from the profiles of this and of the coming steps."""
        period, lift_off, ticks, delta = self._timing
        y = whole_swing(period, lift_off, ticks, delta)
        rows = [(whole_swing(period, lift_off + p.wait, ticks - p.wait - p.early, delta), y) for p in profiles]
        return np.array(rows)

    def feet(
        self, tick: int, support: float, plan: np.ndarray, before: np.ndarray, lift_off: int | None = None,
        profile: SwingProfile | None = None,
    ) -> np.ndarray:  # fmt: skip
        """Position, velocity and acceleration of the left sole, then of the right one, shape (18,) [m, m/s, m/s²].

        Heights are those above the ground under the foot.

        Args:
            tick: of the step.
            support: +1 left, −1 right, 0 both feet stand.
            plan: where the left foot starts and ends this step, then the right one: x, y each, shape (8,) [m].
            before: the result at the tick before.
            lift_off: the last tick before the swing; None is the end of double support.
            profile: of the swing; None is that on level ground.
        """
        period, usual, _, delta = self._timing
        begin = usual if lift_off is None else lift_off
        wait, early, _, apex, ramp = profile or self._usual
        aloft, feet = tick - begin, np.empty(18)
        swinging = -1 if not support else 1 if support > 0 else 0
        remaining = (period - early - tick + 1) * delta, (period - tick + 1) * delta
        above = self._above(begin, apex, ramp)[tick]
        write_feet(swinging, (aloft - wait, aloft, aloft), plan, before, above, remaining, delta, feet)
        return feet

    def put_on_ground(
        self, tick: int, support: float, planes: np.ndarray, feet: np.ndarray, lift_off: int, profile: SwingProfile
    ) -> None:
        """Adds the height of the ground to the soles of `feet` (18,), and its derivatives.

        A sole that stands is on the plane of its foothold. Under a swinging one the ground is (1 − b) times the plane
        that it left and b times the one on which it lands, with b from 0 to 1 as `SwingProfile.change` says.

        Args:
            planes: as `Gait.planes` of the step.
        """
        last, here, coming = planes
        period, _, _, delta = self._timing
        b, rate, change = change_of_ground(profile.change, (period - lift_off) * delta, (tick - lift_off) * delta)
        for foot, side in enumerate((1.0, -1.0)):
            sole = feet[9 * foot : 9 * foot + 9].reshape(3, 3)
            if not support or side == support:
                sole[0, 2] += _over(here, sole[0])
                continue
            start = _over(last, sole[0]), float(last[1:] @ sole[1, :2]), float(last[1:] @ sole[2, :2])
            end = _over(coming, sole[0]), float(coming[1:] @ sole[1, :2]), float(coming[1:] @ sole[2, :2])
            way, climb, more = (e - s for s, e in zip(start, end, strict=True))
            sole[0, 2] += start[0] + b * way
            sole[1, 2] += start[1] + rate * way + b * climb
            sole[2, 2] += start[2] + change * way + 2.0 * rate * climb + b * more

    def add_accelerations(
        self, phase: int, support: np.ndarray, now: np.ndarray, plan: np.ndarray, after: np.ndarray,
        factor: tuple[float, float], most: float, out: np.ndarray, profiles: tuple[SwingProfile, ...] = (),
    ) -> None:  # fmt: skip
        """Adds factor · acceleration of the swing foot at k + 1 … k + H to `out`, clipped to ± `most`, per axis.

        Args:
            phase: tick of the step at k.
            support: +1 left, −1 right, 0 both feet at k + 1 … k + H, shape (H,).
            now: position, velocity, acceleration of the left and right sole at k, shape (2, 3, 3).
            plan: where the left and right foot start and end this step, shape (2, 2, 2) [m].
            after: stance after the coming one, where the next step's swing ends, shape (2,) [m].
            factor: of x and y.
            out: shape (2, H).
            profiles: of the swings of this and of the coming steps; none is that on level ground for all.
        """
        period, lift_off, ticks, delta = self._timing
        profiles = profiles or (self._usual,)
        wait, early = profiles[0][:2]
        begin, duration = (lift_off + wait, lift_off), ((ticks - wait - early) * delta, ticks * delta)
        whole = self._whole(profiles)
        add_accelerations((period, delta), begin, duration, whole, phase, support, now, plan, after, factor, most, out)


def _over(plane: np.ndarray, place: np.ndarray) -> float:
    """Height of a plane at x and y of a place [m]."""
    height, along, across = plane.tolist()
    x, y, _ = place.tolist()
    return float(height + along * x + across * y)
