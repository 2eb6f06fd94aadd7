"""What feet that feel the ground do with it, as machine code; see `footing.Footing`.

The memory (21,) has nine numbers of the left foot, nine of the right one, as `STATE` to `STOP` say, and behind them
height, speed and acceleration of the line under the CoM, all over what is planned. A function's arguments are those of
`Footing` of the same name.
"""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.jit import compiled

STATE, HEIGHT, TILT, BEFORE, STOP, FOOT = 0, 1, 2, 4, 6, 9
"""Of a foot: its state, height and roll and pitch over those planned, the latter at lift-off, and where it stopped."""

LINE, SIZE = 18, 21
AIR, STOPPED, STANDS = 0.0, 1.0, 2.0
"""States: in the air, or not come to the ground yet; come to it early, in its swing; stands where it is planned."""

_SOLE, _GROUND = 9, 7  # elements of a sole in foot_reference and in ground_reference
_ALOFT, _ROLL = 4, 5  # where those of the left sole begin in ground_reference; pitch is three behind roll
_Z_ZMP = 3  # in ground_reference

_DOWN = 0.25  # [m/s]: speed at which a foot that meets no ground where it is planned goes on down
_DEEPEST = 0.08  # [m]: below the other foot
_LATE = 1.0  # tick of a step until which a foot that came down as planned carries load
_FOLLOWS = 0.5  # share of a tick's difference by which a sole's target follows the sole that carries load
_LEVELS = 0.6  # share of its swing in which a sole turns back to its planned tilt
_FREQUENCY = 9.0  # [rad/s]: of the critically damped motion of the CoM's line to the height of the stance foot


@compiled
def blend(s: float) -> tuple[float, float, float]:
    """10s³ − 15s⁴ + 6s⁵ from 0 to 1, and its first two derivatives."""
    s = min(max(s, 0.0), 1.0)
    r = s * (1.0 - s)
    return s**3 * (10.0 + s * (-15.0 + 6.0 * s)), 30.0 * r * r, 60.0 * r * (1.0 - 2.0 * s)


@compiled
def feel(
    memory: np.ndarray, timing: tuple[int, float, int], tick: float, support: float, lift_off: float, feet: np.ndarray,
    ground: np.ndarray, measured: np.ndarray, loads: np.ndarray, least: float,
) -> None:  # fmt: skip
    """Moves the memory on to tick k + 1, by what is measured at tick k.

    Args:
        timing: N, δ and the delay of what is measured [ticks, s, ticks].
        tick, lift_off: of the step. support: +1 left, −1 right, 0 both.
        least: load from which a foot carries [N].
    """
    period, delta, delay = timing
    total = 0.0
    for i in range(len(measured)):
        total += measured[i]
    if math.isfinite(total + loads[0] + loads[1]):
        for foot in range(2):
            own, other = memory[FOOT * foot :], memory[FOOT * (1 - foot) :]
            carries = support == 0.0 or (support > 0.0) == (foot == 0)
            loaded, swings = loads[foot] > least, not carries and tick > lift_off
            height = feet[_SOLE * foot + 2]
            if not carries and tick == lift_off:
                own[STATE], own[BEFORE], own[BEFORE + 1] = AIR, own[TILT], own[TILT + 1]
                own[TILT], own[TILT + 1] = 0.0, 0.0
            if own[STATE] == AIR:
                if swings:
                    if tick >= period - 1:
                        own[HEIGHT] = other[HEIGHT]
                    if loaded and 2.0 * tick > period + lift_off:
                        own[STATE] = STOPPED
                        for axis in range(3):
                            own[STOP + axis] = measured[6 * foot + axis]
                elif carries:
                    if loaded:
                        own[STATE], own[HEIGHT] = STANDS, measured[6 * foot + 2] - height
                    elif tick >= _LATE + delay:
                        own[HEIGHT] = max(own[HEIGHT] - _DOWN * delta, other[HEIGHT] - _DEEPEST)
            if own[STATE] != AIR and loaded:
                for i in range(2):
                    planned = ground[_GROUND * foot + _ROLL + 3 * i]
                    own[TILT + i] += _FOLLOWS * (measured[6 * foot + 3 + i] - planned - own[TILT + i])
                if own[STATE] == STOPPED:
                    own[STOP + 2] += _FOLLOWS * (measured[6 * foot + 2] - own[STOP + 2])
                else:
                    own[HEIGHT] += _FOLLOWS * (measured[6 * foot + 2] - height - own[HEIGHT])
            if own[STATE] == STOPPED and carries and tick >= delay:
                own[STATE], own[HEIGHT] = STANDS, own[STOP + 2] - height
    goal = 0.5 * (memory[HEIGHT] + memory[FOOT + HEIGHT])
    if support != 0.0:
        goal = memory[HEIGHT] if support > 0.0 else memory[FOOT + HEIGHT]
    z, speed = memory[LINE], memory[LINE + 1]
    acceleration = _FREQUENCY * (_FREQUENCY * (goal - z) - 2.0 * speed)
    memory[LINE] = z + delta * (speed + 0.5 * delta * acceleration)
    memory[LINE + 1], memory[LINE + 2] = speed + delta * acceleration, acceleration


@compiled
def put_where_met(
    memory: np.ndarray, timing: tuple[int, float, int], tick: float, support: float, lift_off: float,
    feet: np.ndarray, ground: np.ndarray,
) -> None:  # fmt: skip
    """Moves foot_reference (18,) and ground_reference (18,) to where the ground was met."""
    period, delta, delay = timing
    swing = period - lift_off
    for foot in range(2):
        own, other = memory[FOOT * foot :], memory[FOOT * (1 - foot) :]
        sole, tilt = feet[_SOLE * foot : _SOLE * foot + _SOLE], ground[_ROLL + _GROUND * foot :]
        carries = support == 0.0 or (support > 0.0) == (foot == 0)
        in_air = False
        if own[STATE] == STOPPED:
            for i in range(_SOLE):
                sole[i] = 0.0
            for axis in range(3):
                sole[axis] = own[STOP + axis]
        elif carries or tick <= lift_off:
            sole[2] += own[HEIGHT]
            if carries and own[STATE] == AIR and tick > _LATE + delay:
                sole[5] -= _DOWN
                in_air = True
        else:
            in_air = True
            s, way = (tick - lift_off) / swing, other[HEIGHT] - own[HEIGHT]
            share, rate, change = blend(s)
            sole[2] += own[HEIGHT] + way * share
            sole[5] += way * rate / (swing * delta)
            sole[8] += way * change / (swing * delta) ** 2
            share, rate, change = blend(s / _LEVELS)
            for i in range(2):
                tilt[3 * i] += (1.0 - share) * own[BEFORE + i]
                tilt[3 * i + 1] -= rate / (_LEVELS * swing * delta) * own[BEFORE + i]
                tilt[3 * i + 2] -= change / (_LEVELS * swing * delta) ** 2 * own[BEFORE + i]
        ground[_ALOFT + _GROUND * foot] = 1.0 if in_air else 0.0
        tilt[0] += own[TILT]
        tilt[3] += own[TILT + 1]
    for i in range(3):
        ground[i] += memory[LINE + i]
    ground[_Z_ZMP] += memory[LINE]
