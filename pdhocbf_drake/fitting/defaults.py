"""The default values of a scenario, made to fit its robot."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from pdhocbf_drake.fitting.facts import RobotFacts
from pdhocbf_drake.fitting.rules import LENGTH, OF_BARRIERS, RULES, Scale, sizes_of, sway_price
from pdhocbf_drake.fitting.step import BOX, fitted_step
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.quantities import QUANTITIES

_STEP: Final = GaitConfig()
"""The step that what is counted in ticks, or paid for in each of them, is written for."""

_OF_STEP: Final = ("gait.stride", "gait.tick", "gait.ticks_per_step")
_STEPS_OF_PLANT: Final = 10  # in a tick that is shorter than the default one


class Fitted(NamedTuple):
    """Values of a scenario that fit a robot.

    Attributes:
        data: all values of the scenario.
        changed: key, and its value as it is written for the packaged robot, and for this one.
        facts: the robot.
        reasons: a sentence for each limit of the robot that has changed its step.
    """

    data: dict[str, Any]
    changed: dict[str, tuple[Any, Any]]
    facts: RobotFacts
    reasons: tuple[str, ...]


def fitted(data: dict[str, Any], given: dict[str, Any], biped: Biped) -> Fitted:
    """A walking scenario whose values fit a robot; those that the user has given stay as they are.

    Args:
        data: all values of the scenario, the defaults as they are written for the packaged robot.
        given: the keys that the user has given, with any value.
        biped: the robot.
    """
    gait = data["gait"]
    facts = RobotFacts.of(biped)._replace(com_height=gait["com_height"], stance_width=gait["stance_width"])
    length, sole = sizes_of(facts)
    step = fitted_step(biped, gait, _part(given, "gait"), length)
    ticks = step.ticks / _STEP.ticks_per_step
    box = step.box / BOX if step.box else 1.0
    scale = Scale(length, ticks * step.tick / _STEP.tick, ticks, sole, box, step.pull, facts)
    wanted: dict[str, Any] = {
        "gait.stride": step.stride, "gait.tick": step.tick, "gait.ticks_per_step": step.ticks,
        **{key: rule(_value(data, key), scale) for key, rule in RULES.items() if _value(data, key) is not None},
        **_of_barriers(data, scale),
    }  # fmt: skip
    if data["mpc"]["zmp_centre_weight"] and not _has(given, "mpc.zmp_centre_weight"):
        box = (gait if _has(given, "gait.zmp_box") else {"zmp_box": wanted["gait.zmp_box"]})["zmp_box"]
        price = sway_price(data["mpc"]["zmp_centre_weight"], box[1], scale)
        if price > wanted["mpc.zmp_centre_weight"]:
            wanted["mpc.sway_weight"] = price
    if not data["path"]:
        wanted.pop("path_speed")
    if step.tick < _STEP.tick:
        wanted["plant.time_step"] = min(data["plant"]["time_step"], step.tick / _STEPS_OF_PLANT)
    changed = {
        key: (_value(data, key), value)
        for key, value in wanted.items()
        if not _has(given, key) and value != _value(data, key)
    }
    for key, (_, value) in changed.items():
        data = _with(data, key.split("."), value)
    return Fitted(data, changed, facts, step.reasons)


def is_complete(given: dict[str, Any]) -> bool:
    """Whether a user has given every value that would be made to fit, as in the scenario.yaml of a run."""
    return all(_has(given, key) for key in (*_OF_STEP, *RULES))


def _of_barriers(data: dict[str, Any], scale: Scale) -> dict[str, Any]:
    """Margins of bounds that follow an orbit, and the strides of their walks."""
    wanted = {}
    for name, barrier in data["barriers"].items():
        quantity = QUANTITIES[barrier["quantity"] or "forward_speed"]
        for key, rule in (("margin", OF_BARRIERS[quantity.unit]), ("stride", LENGTH)):
            if barrier["bound"][key] is not None:
                wanted[f"barriers.{name}.bound.{key}"] = rule(barrier["bound"][key], scale)
    return wanted


def _part(data: dict[str, Any], key: str) -> dict[str, Any]:
    part = data.get(key)
    return part if isinstance(part, dict) else {}


def _value(data: Any, key: str) -> Any:
    """The value at a dotted key; None where it has none."""
    for part in key.split("."):
        data = data.get(part) if isinstance(data, dict) else None
    return data


def _has(data: dict[str, Any], key: str) -> bool:
    """Whether a dotted key is given; a value in place of a map gives all keys of that map."""
    here: Any = data
    for part in key.split("."):
        if not isinstance(here, dict):
            return True
        if part not in here:
            return False
        here = here[part]
    return True


def _with(data: dict[str, Any], path: list[str], value: Any) -> dict[str, Any]:
    first, rest = path[0], path[1:]
    return {**data, first: _with(data[first], rest, value) if rest else value}
