"""Scenarios from the package or a user's file, with `extends` and overrides resolved, fitted to robot and ground."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pdhocbf_drake.config import as_name
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot.locate import load_robot_config
from pdhocbf_drake.simulation.scenario import DEFAULT_ROBOT, Scenario
from pdhocbf_drake.simulation.scenario_layers import anchored, find_layers, merged, scenario_names
from pdhocbf_drake.yaml_text import merge, parse_settings

if TYPE_CHECKING:
    from pdhocbf_drake.fitting.defaults import Fitted

__all__ = ["GROUND_KEYS", "Written", "load_fitted", "load_scenario", "load_written", "scenario_names"]

GROUND_KEYS = "gait.com_height", "gait.ticks_per_step", "mpc.horizon"  # which the ground chooses where nobody does


def load_scenario(scenario: str, text: str = "") -> Scenario:
    """The scenario called `scenario` (a name, `FILE` or `FILE:NAME`) with the YAML `text` merged on top.

    Values that neither the file nor `text` gives fit the scenario's robot, see `fitting.rules`, and its ground, see
    `ground_choice`.

    Raises:
        InputError: it does not exist, is not YAML, or holds a wrong key or value.
        ModelError: the robot's file or model can't be used.
    """
    return load_fitted(scenario, text)[0]


def load_fitted(scenario: str, text: str = "") -> tuple[Scenario, Fitted | None]:
    """The same, with what has been made to fit the robot; None where nothing had to be."""
    written = load_written(scenario, text)
    found, fit = _fitted_to_robot(written)
    if found.ground:
        from pdhocbf_drake.simulation.ground_choice import chosen_for_ground  # here, since it loads Drake

        found = chosen_for_ground(found, written.free).scenario
    return found, fit


def _fitted_to_robot(written: Written) -> tuple[Scenario, Fitted | None]:
    found = written.scenario
    if found.system != "biped" or found.robot == DEFAULT_ROBOT:
        return found, None
    # Here, since it loads Drake, which the packaged robot does not need yet.
    from pdhocbf_drake.fitting.defaults import fitted, is_complete
    from pdhocbf_drake.robot import Biped

    if is_complete(written.given):
        return found, None
    fit = fitted(found.to_dict(), written.given, Biped.load(found.robot))
    return Scenario.from_dict(fit.data, written.where), fit if fit.changed else None


class Written(NamedTuple):
    """A scenario with default values as they are written, for the packaged robot.

    Attributes:
        given: the keys that a user's file or overrides give. where: its name in messages.
        free: `GROUND_KEYS` that none of its layers gives.
    """

    scenario: Scenario
    given: dict[str, Any]
    where: str
    free: frozenset[str]


def load_written(scenario: str, text: str = "") -> Written:
    """The scenario before anything is made to fit its robot; arguments and errors as in `load_scenario`."""
    (data, given), name = find_layers(scenario)
    data = {**data, "name": data.get("name", name)}
    if text:
        overrides = parse_settings(text, "--text")
        if "extends" in overrides:
            raise InputError("--text overrides a scenario and cannot extend another one; name that one as SCENARIO")
        data = merged(data, anchored(overrides, Path.cwd()), "--text")
        given = merge(given, overrides)
    named = data["name"]
    where = named if isinstance(named, str) and as_name(named) == named else name
    return Written(Scenario.from_dict(_completed(data), where), given, where, _free(data))


def _free(data: dict[str, Any]) -> frozenset[str]:
    """Those of `GROUND_KEYS` that a scenario's data do not give."""
    parts = {key: data.get(key.partition(".")[0]) for key in GROUND_KEYS}
    return frozenset(
        key for key, part in parts.items() if not (isinstance(part, dict) and key.partition(".")[2] in part)
    )


def _completed(data: dict[str, Any]) -> dict[str, Any]:
    """The data, with the robot's CoM height and stance width where a biped's scenario omits them."""
    robot, gait = data.get("robot", DEFAULT_ROBOT), data.get("gait", {})
    walks = data.get("system", "biped") == "biped" and isinstance(robot, str) and isinstance(gait, dict)
    if not walks or {"com_height", "stance_width"} <= set(gait):
        return data
    config = load_robot_config(robot)
    return {**data, "gait": {"com_height": config.com_height, "stance_width": config.stance_width, **gait}}
