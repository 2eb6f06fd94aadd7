"""What feet that feel the ground do with it, as machine code; see `footing.Footing`.

The memory (30,) has 13 numbers of the left foot, 13 of the right one, as `STATE` to `FROM` say, and behind them
height, speed and acceleration of the line under the CoM, all over what is planned, and by how many ticks the stance
foot has come to the ground late. A function's arguments are those of `Footing` of the same name.
"""

from __future__ import annotations

import math

import numpy as np

from pdhocbf_drake.jit import compiled

STATE, HEIGHT, TILT, BEFORE, STOP, GAP, FROM, FOOT = 0, 1, 2, 4, 6, 9, 12, 13
"""Of a foot: its state, height and roll and pitch over those planned, the latter at lift-off, where it stopped, and at
its lift-off how far it was from where it was planned, and the tick of the step."""

LINE, LATE, SIZE = 26, 29, 30
AIR, STOPPED, STANDS = 0.0, 1.0, 2.0
"""States: in the air, or not come to the ground yet; on the ground in its swing, where it has come to it early, or
waits for the other foot to come to it; stands where it is planned."""

_SOLE, _GROUND = 9, 7  # elements of a sole in foot_reference and in ground_reference
_ALOFT, _ROLL = 4, 5  # where those of the left sole begin in ground_reference; pitch is three behind roll
_Z_ZMP = 3  # in ground_reference

_DOWN = 0.5  # [m/s]: speed at which a foot that meets no ground goes on down, less where loads are late
_DEEPEST = 0.08  # [m]: below the other foot
_UNKNOWN = 2.0  # ticks over the present one, by which a step is taken to be late whose foot has not come down
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
def lift(own: np.ndarray, tick: float, lift_off: float, sole: np.ndarray, waits: bool) -> None:
    """Lifts a foot off; one that has to wait for the other to come to the ground stops where it stands.

    Args:
        own: of the foot in the memory. sole: of the foot in foot_reference.
    """
    if waits and own[STATE] != AIR:
        if own[STATE] == STANDS:
            own[STATE] = STOPPED
            own[STOP], own[STOP + 1], own[STOP + 2] = sole[0], sole[1], sole[2] + own[HEIGHT]
    elif tick == lift_off or own[STATE] != AIR:
        stopped, own[FROM] = own[STATE] == STOPPED, tick
        for axis in range(3):
            own[GAP + axis] = own[STOP + axis] - sole[axis] if stopped else 0.0
        if stopped:
            own[GAP + 2] -= own[HEIGHT]
        own[STATE], own[BEFORE], own[BEFORE + 1] = AIR, own[TILT], own[TILT + 1]
        own[TILT], own[TILT + 1] = 0.0, 0.0


@compiled
def feel(
    memory: np.ndarray, timing: tuple[int, float, int], tick: float, support: float, lift_off: float, feet: np.ndarray,
    ground: np.ndarray, measured: np.ndarray, loads: np.ndarray, limits: tuple[float, float],
) -> None:  # fmt: skip
    """Moves the memory on to tick k + 1, by what is measured at tick k.

    Args:
        timing: N, δ and the delay of what is measured [ticks, s, ticks].
        tick, lift_off: of the step. support: +1 left, −1 right, 0 both.
        limits: load from which a foot carries, and from which one that swings has met the ground [N].
    """
    period, delta, delay = timing
    least, met = limits
    if tick == 0.0:
        memory[LATE] = 0.0
    total = 0.0
    for i in range(len(measured)):
        total += measured[i]
    if math.isfinite(total + loads[0] + loads[1]):
        stance = 0 if support > 0.0 else 1
        if support != 0.0 and memory[FOOT * stance + STATE] == AIR and tick >= _LATE + delay:
            memory[LATE] = tick - _LATE - delay if loads[stance] > least else tick + _UNKNOWN
        for foot in range(2):
            own, other = memory[FOOT * foot :], memory[FOOT * (1 - foot) :]
            carries = support == 0.0 or (support > 0.0) == (foot == 0)
            loaded, swings = loads[foot] > least, not carries and tick > lift_off
            height = feet[_SOLE * foot + 2]
            if not carries and tick >= lift_off and not 2.0 * tick > period + lift_off:
                lift(own, tick, lift_off, feet[_SOLE * foot :], tick < lift_off + memory[LATE])
            if own[STATE] == AIR:
                if swings:
                    if tick >= period - 1:
                        own[HEIGHT] = other[HEIGHT]
                    if loads[foot] > met and 2.0 * tick > period + lift_off:
                        own[STATE] = STOPPED
                        for axis in range(3):
                            own[STOP + axis] = measured[6 * foot + axis]
                elif carries:
                    if loaded:
                        own[STATE], own[HEIGHT] = STANDS, measured[6 * foot + 2] - height
                    elif tick >= _LATE + delay:
                        own[HEIGHT] = max(own[HEIGHT] - _DOWN / (1.0 + delay) * delta, other[HEIGHT] - _DEEPEST)
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
    for foot in range(2):
        own, other = memory[FOOT * foot :], memory[FOOT * (1 - foot) :]
        swing = period - own[FROM]
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
                sole[5] -= _DOWN / (1.0 + delay)
                in_air = True
        else:
            in_air = True
            s = (tick - own[FROM]) / swing
            share, rate, change = blend(s)
            sole[2] += own[HEIGHT]
            for axis in range(3):
                way = (other[HEIGHT] - own[HEIGHT] if axis == 2 else 0.0) - own[GAP + axis]
                sole[axis] += own[GAP + axis] + way * share
                sole[3 + axis] += way * rate / (swing * delta)
                sole[6 + axis] += way * change / (swing * delta) ** 2
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
