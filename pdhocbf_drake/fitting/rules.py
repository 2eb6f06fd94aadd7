"""How each default value changes with the robot: one rule a key."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from pdhocbf_drake.fitting.facts import PACKAGED, RobotFacts
from pdhocbf_drake.walking.config import GaitConfig

_GAIT: Final = GaitConfig()
_BOX: Final = _GAIT.zmp_box[1]
_TICKS: Final = _GAIT.ticks_per_step * _GAIT.double_support_ticks * _GAIT.tick**2  # N D δ² [s²]
_INSIDE = 0.6
_GAP: Final = PACKAGED.stance_width - 2.0 * PACKAGED.sole[1]  # between the packaged soles [m]
_LEFT = 0.3  # least share of a wide gap between the soles
_DIGITS = 4  # of a value that a rule has changed


class Scale(NamedTuple):
    """A robot and its step over the packaged robot and its step.

    Attributes:
        length: of the legs. time: of a step's duration. ticks: of a step's ticks.
        sole: of the sole's length and width.
        box: of the length of the ZMP box, as a share of the sole's.
        pull: of how far the swing leg drives the CoM off the pendulum's orbit, for a robot of which it is more.
        facts: the robot.
    """

    length: float
    time: float
    ticks: float
    sole: tuple[float, float]
    box: float
    pull: float
    facts: RobotFacts


Rule = Callable[[Any, Scale], Any]


def sizes_of(facts: RobotFacts) -> tuple[float, tuple[float, float]]:
    """Length of the legs, and length and width of the soles, over those of the packaged robot."""
    length, width = (half / whole for half, whole in zip(facts.sole, PACKAGED.sole, strict=True))
    return facts.leg / PACKAGED.leg, (length, width)


def _by(factor: Callable[[Scale], float]) -> Rule:
    def rule(value: Any, scale: Scale) -> Any:
        return [_rounded(number, factor(scale)) for number in value] if _is_list(value) else _rounded(
            value, factor(scale)
        )  # fmt: skip

    return rule


def _rounded(value: float, factor: float) -> float:
    return value if factor == 1.0 or not value else float(f"{value * factor:.{_DIGITS}g}")


def _is_list(value: Any) -> bool:
    return isinstance(value, list | tuple)


def _ticks(value: int, scale: Scale) -> int:
    return round(value * scale.ticks) if value else 0


def _at_least_one(value: int, scale: Scale) -> int:
    return max(1, _ticks(value, scale))


def _freeze(value: int, scale: Scale) -> int:
    """Later with soles that are small for the legs, on which the ZMP makes up for less of a missed foothold."""
    return math.floor(value * scale.ticks * min(1.0, min(scale.sole) / scale.length) + 1e-9)


def _horizon(value: int, scale: Scale) -> int:
    """As many gaits as before; the step's ticks are whole."""
    return round(value * scale.ticks)


def _gait_box(value: tuple[float, float], scale: Scale) -> list[float]:
    """As `_box`, as long as swing leg and ankles make it."""
    return _box((_rounded(value[0], scale.box), value[1]), scale)


def _box(value: tuple[float, float], scale: Scale) -> list[float]:
    """Sides over those of the sole; rounded down, since no box may be larger than the sole."""
    return [_floored(side, factor) for side, factor in zip(value, scale.sole, strict=True)]


def _recovery_box(value: tuple[float, float], scale: Scale) -> list[float]:
    """As `_box`, but no longer for its width than the packaged one, unless the gait's own box is.

    With the ZMP at a corner, ahead and aside at once, the sole rests on a point, about which friction does not keep it
    from turning. Of a narrow sole the ZMP is at a side edge as soon as it is anywhere.
    """
    length, width = _box(value, scale)
    return [min(length, max(_floored(value[0], min(scale.sole)), _gait_box(_GAIT.zmp_box, scale)[0])), width]


def _floored(value: float, factor: float) -> float:
    return value if factor == 1.0 else math.floor(value * factor * 1e4 + 1e-6) / 1e4


def _margin(value: float, scale: Scale) -> float:
    """With the legs, unless the soles are smaller than they."""
    return _rounded(value, min(scale.length, *scale.sole))


def _least_width(value: float, scale: Scale) -> float:
    """As much less than the stance width, as a share of the gap between the soles or of the legs, the smaller one."""
    facts = scale.facts
    gap = min(max(facts.stance_width - 2.0 * facts.sole[1], 0.0), scale.length * _GAP)  # none where soles overlap
    return _as_written(value, scale) or _rounded(
        max(facts.stance_width - (PACKAGED.stance_width - value) * gap / _GAP, 0.0), 1.0 + 1e-15
    )


def _least_width_of_recovery(value: float, scale: Scale) -> float:
    """As above, but of wide stances a larger share, since a foot that is to catch the robot lands where it falls to.

    What is left of the gap between the soles is room for shoes and shanks that are wider than they.
    """
    facts = scale.facts
    gap, share = facts.stance_width - 2.0 * facts.sole[1], (value - 2.0 * PACKAGED.sole[1]) / _GAP
    left = min(share * gap, max(share * scale.length * _GAP, _LEFT * gap))
    return _as_written(value, scale) or _rounded(max(2.0 * facts.sole[1] + left, 0.0), 1.0 + 1e-15)


def _as_written(value: float, scale: Scale) -> float:
    """The packaged robot's own value for its stance and soles, else 0."""
    facts = scale.facts
    same = (facts.stance_width, facts.sole) == (PACKAGED.stance_width, PACKAGED.sole) and scale.length == 1.0
    return value if same else 0.0


def sway_price(value: float, box: float, scale: Scale) -> float:
    """The price of the ZMP's lateral distance from its boxes' centres, in place of `mpc.zmp_centre_weight`.

    With the price w, N ticks in a step and D in double support, effort and price are least where the ZMP is so far
    inside the centres of both boxes:

        d = 2 · width/(4 + w N D δ²)

    Where that is beyond the boxes' inner edges, the ZMP stays on both of them, from where it can't follow a CoM that
    falls inwards: the sway grows to one side, and feet set wider each time carry the walk off its path. With stances
    wider than the packaged one, counted in half boxes, the price grows so that d tends to `_INSIDE` of a half box.

    Args:
        value: `mpc.zmp_centre_weight` as it is written for the packaged robot [1/s²]. box: width of the ZMP box [m].
    """
    wider = max(scale.facts.stance_width / box - PACKAGED.stance_width / _BOX, 0.0) * 2.0
    return _rounded((value + 2.0 * wider / (_INSIDE * _TICKS)) / scale.time**2, 1.0 + 1e-15)


def _slack(value: tuple[float, float], scale: Scale) -> list[float]:
    """The price of a speed to the power of one is a speed; to the power of two it is a number."""
    return [_rounded(value[0], scale.length / scale.time), value[1]]


LENGTH: Final = _by(lambda scale: scale.length)
SPEED: Final = _by(lambda scale: scale.length / scale.time)
TIME: Final = _by(lambda scale: scale.time)
ONCE: Final = _by(lambda scale: scale.ticks / scale.time**2)  # [1/s²], a price beside one of ZMP speeds at each tick

RULES: Final[dict[str, Rule]] = {
    "from_time": TIME,
    "path_speed": SPEED,
    "gait.double_support_ticks": _ticks,
    "gait.zmp_box": _gait_box,
    "gait.com_height_amplitude": LENGTH,
    "gait.swing_height": LENGTH,
    "mpc.horizon": _horizon,
    "mpc.foothold_weight": ONCE,
    "mpc.zmp_centre_weight": ONCE,
    "mpc.path_correction": LENGTH,
    "mpc.step_tolerance": LENGTH,
    "mpc.stance_width_min": _least_width,
    "mpc.slack_weight": _slack,
    "mpc.zmp_margin": _margin,
    "mpc.zmp_velocity_max": SPEED,
    "mpc.freeze_ticks": _ticks,
    "mpc.stop_ticks": _at_least_one,
    "mpc.step_reach": LENGTH,
    "mpc.tail_weight": ONCE,
    "mpc.recovery.noticed": LENGTH,
    "mpc.recovery.calm": LENGTH,
    "mpc.recovery.calm_ticks": _at_least_one,
    "mpc.recovery.foothold_weight": ONCE,
    "mpc.recovery.tail_weight": ONCE,
    "mpc.recovery.zmp_box": _recovery_box,
    "mpc.recovery.step_reach": LENGTH,
    "mpc.recovery.stance_width_min": _least_width_of_recovery,
    "mpc.recovery.path_correction": LENGTH,
    "mpc.recovery.slack_weight": _slack,
    "mpc.recovery.freeze_ticks": _freeze,
    "plant.penetration_allowance": LENGTH,
    "plant.stiction_tolerance": SPEED,
}
"""The rule of each default value. Accelerations and counts of steps are the same for every robot; stride, tick and
ticks per step are those of `fitting.step`; CoM height, stance width and gains are those of the robot."""

OF_BARRIERS: Final[dict[str, Rule]] = {
    "m": _by(lambda scale: scale.length * scale.pull),
    "m/s": _by(lambda scale: scale.length / scale.time * scale.pull),
}
"""The rule of the margin of a bound, by the unit of its quantity.

The bound follows the orbit of the pendulum, from which the orbit of all links differs by what the swing leg does.
"""
