"""The swing foot: minimum jerk along the ground, a smooth bump above it, and its accelerations over the horizon."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.walking.gait import Gait


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
    present landing; its height depends on the time since lift-off alone.
    """

    def __init__(self, gait: Gait) -> None:
        config, ground = gait.config, np.zeros(2)
        lift_off, duration = config.double_support_ticks, gait.swing_ticks() * config.tick
        self._timing = (gait.period, lift_off, duration, config.tick)
        points = [
            swing_point(ground, ground, config.swing_height, duration, (tick - lift_off) * config.tick)
            for tick in range(gait.period + 1)
        ]
        # Height of the swing sole and its derivatives at each tick of a step, (N + 1, 3) [m, m/s, m/s²].
        self._above = np.array([[part[2] for part in point] for point in points])
        # Acceleration of a swing by one metre from rest to rest at each tick of a step, (N,) [1/s²].
        s = np.clip((np.arange(gait.period) - lift_off) / gait.swing_ticks(), 0.0, 1.0)
        self._whole = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration**2

    def feet(self, tick: int, support: float, plan: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Position, velocity and acceleration of the left sole, then of the right one, shape (18,) [m, m/s, m/s²].

        Args:
            tick: of the step.
            support: +1 left, −1 right, 0 both feet stand.
            plan: where the left foot starts and ends this step, then the right one: x, y each, shape (8,) [m].
            before: the result at the tick before.
        """
        _, lift_off, duration, delta = self._timing
        aloft, feet = tick - lift_off, np.empty(18)
        swinging = -1 if not support else 1 if support > 0 else 0
        remaining = duration - (aloft - 1) * delta
        write_feet(swinging, aloft, plan, before, self._above[tick], remaining, delta, feet)
        return feet

    def add_accelerations(
        self, phase: int, support: np.ndarray, now: np.ndarray, plan: np.ndarray, after: np.ndarray,
        factor: tuple[float, float], most: float, out: np.ndarray,
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
        """
        add_accelerations(self._timing, self._whole, phase, support, now, plan, after, factor, most, out)


@compiled
def least_jerk(
    position: float, velocity: float, acceleration: float, end: float, remaining: float
) -> tuple[float, float, float, float, float, float]:
    """p, v, a, c₃, c₄, c₅ of p + v s + a s²/2 + c₃ s³ + c₄ s⁴ + c₅ s⁵ [m], s = time/`remaining`: least jerk to rest."""
    v, a, gap = velocity * remaining, acceleration * remaining**2, end - position
    third = 10.0 * gap - 6.0 * v - 1.5 * a
    fourth = -15.0 * gap + 8.0 * v + 1.5 * a
    fifth = 6.0 * gap - 3.0 * v - 0.5 * a
    return position, v, a, third, fourth, fifth


@compiled
def onward(
    position: float, velocity: float, acceleration: float, end: float, remaining: float, ahead: float
) -> tuple[float, float, float]:
    """Position, velocity, acceleration along one axis `ahead` seconds later on the motion of least jerk to `end`.

    From rest it is the motion of `swing_point`. Planned anew at every tick for an end that moves, it has no jump in
    position, velocity or acceleration.

    Args:
        position, velocity, acceleration: now [m, m/s, m/s²].
        end: where the foot comes to rest [m].
        remaining: time until then, > 0 [s]. ahead: at most `remaining` [s].
    """
    if ahead >= remaining - 1e-9:
        return end, 0.0, 0.0
    s = ahead / remaining
    c = least_jerk(position, velocity, acceleration, end, remaining)
    return (
        c[0] + s * (c[1] + s * (0.5 * c[2] + s * (c[3] + s * (c[4] + s * c[5])))),
        (c[1] + s * (c[2] + s * (3.0 * c[3] + s * (4.0 * c[4] + s * 5.0 * c[5])))) / remaining,
        (c[2] + s * (6.0 * c[3] + s * (12.0 * c[4] + s * 20.0 * c[5]))) / remaining**2,
    )


@compiled
def write_feet(
    swinging: int, aloft: int, plan: np.ndarray, before: np.ndarray, above: np.ndarray, remaining: float, tick: float,
    feet: np.ndarray,
) -> None:  # fmt: skip
    """Writes `Swing.feet`.

    Args:
        swinging: the foot that swings, 0 left, 1 right, −1 none. aloft: ticks since lift-off.
        above: the swing sole's height and its derivatives, (3,).
        remaining: time left to swing at the tick before [s]. tick: δ [s].
    """
    for i in range(18):
        feet[i] = 0.0
    for foot in range(2):
        for axis in range(2):
            at = 9 * foot + axis
            feet[at] = plan[4 * foot + axis]
            if foot == swinging and aloft > 0:
                place, velocity, acceleration = feet[at], 0.0, 0.0
                if aloft > 1:
                    place, velocity, acceleration = before[at], before[at + 3], before[at + 6]
                end = plan[4 * foot + 2 + axis]
                feet[at], feet[at + 3], feet[at + 6] = onward(place, velocity, acceleration, end, remaining, tick)
        if foot == swinging and aloft > 0:
            for derivative in range(3):
                feet[9 * foot + 3 * derivative + 2] = above[derivative]


@compiled
def add_accelerations(
    timing: tuple[int, int, float, float], whole: np.ndarray, phase: int, support: np.ndarray, now: np.ndarray,
    plan: np.ndarray, after: np.ndarray, factor: tuple[float, float], most: float, out: np.ndarray,
) -> None:  # fmt: skip
    """Adds what `Swing.add_accelerations` describes.

    Args:
        timing: N and lift-off [ticks], duration of a swing and tick [s].
        whole: acceleration of a swing by one metre at each tick of a step, (N,) [1/s²].
    """
    period, lift_off, duration, tick = timing
    horizon = len(support)
    count = min(period - 1 - phase, horizon)  # ticks left of this step
    left = duration - (phase - lift_off) * tick  # seconds left of its swing
    coming = count
    while coming < horizon and support[coming] == 0.0:
        coming += 1
    for axis in range(2):
        if count and support[0] != 0.0:
            foot = 1 if support[0] > 0.0 else 0
            start, end = plan[foot, 0, axis], plan[foot, 1, axis]
            place, velocity, acceleration = now[foot, 0, axis], now[foot, 1, axis], now[foot, 2, axis]
            _, _, a, third, fourth, fifth = least_jerk(place, velocity, acceleration, end, left)
            for i in range(count):
                if phase <= lift_off:
                    value = (end - start) * whole[phase + 1 + i]
                else:
                    s = (i + 1) * tick / left
                    value = (a + s * (6.0 * third + s * (12.0 * fourth + s * 20.0 * fifth))) / left**2
                out[axis, i] += min(max(factor[axis] * value, -most), most)
        if coming < horizon:
            foot = 1 if support[coming] > 0.0 else 0
            way = after[axis] - plan[foot, 1, axis]
            for i in range(count, horizon):
                value = way * whole[(phase + 1 + i) % period] * abs(support[i])
                out[axis, i] += min(max(factor[axis] * value, -most), most)
