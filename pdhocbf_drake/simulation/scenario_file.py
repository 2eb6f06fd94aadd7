"""Scenarios from the package or a user's file, with `extends` and overrides resolved.

A file holds one scenario, or several under their names (`FILE:NAME`). The keys after `extends: NAME` are merged in
depth into another scenario, of the same file or of the package.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pdhocbf_drake.config import as_name
from pdhocbf_drake.config_errors import shown
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot.locate import load_robot_config
from pdhocbf_drake.simulation.scenario import DEFAULT_ROBOT, Scenario
from pdhocbf_drake.yaml_text import merge, parse_yaml, read_yaml

if TYPE_CHECKING:
    from pdhocbf_drake.fitting.defaults import Fitted

_PACKAGED = Path(__file__).resolve().parent.parent / "scenarios"
GROUND_KEYS = "gait.com_height", "gait.ticks_per_step", "mpc.horizon"  # which the ground chooses where nobody does
_Layers = tuple[dict[str, Any], dict[str, Any]]  # a scenario's values, and the keys that a user's file gives


def scenario_names() -> list[str]:
    """Names of the package's scenarios."""
    return sorted(path.stem for path in _PACKAGED.glob("*.yaml"))


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
    (data, given), name, folder = _find(scenario)
    data = _anchored({**data, "name": data.get("name", name)}, folder)
    if text:
        overrides = parse_yaml(text, "--text")
        if not isinstance(overrides, dict):
            raise InputError(f"--text must hold a YAML map such as 'gait: {{stride: 0.1}}', given {shown(text)}")
        if "extends" in overrides:
            raise InputError("--text overrides a scenario and cannot extend another one; name that one as SCENARIO")
        data = _merged(data, _anchored(overrides, Path.cwd()), "--text")
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


def _find(scenario: str) -> tuple[_Layers, str, Path]:
    """Layers, name and folder of a packaged scenario, or of the one at FILE or FILE:NAME."""
    head, _, entry = scenario.rpartition(":")
    if _is_file(head):
        siblings = _map(read_yaml(Path(head)), head)
        if entry not in siblings:
            raise InputError(f"{Path(head)} has no scenario {shown(entry)}; it has {_listed(siblings)}")
        where = f"{Path(head)}:{entry}"
        layers = _extended(_map(siblings[entry], where), siblings, where, (entry,))
        return layers, as_name(entry), Path(head).resolve().parent
    if not _is_file(scenario):
        return _packaged(scenario), scenario, _PACKAGED
    file = Path(scenario)
    data = _map(read_yaml(file), str(file))
    if data and not set(data) & {*Scenario.model_fields, "extends"} and all(isinstance(v, dict) for v in data.values()):
        raise InputError(f"{file} holds several scenarios; choose one as {file}:NAME from {_listed(data)}")
    # A run folder's scenario.yaml holds the scenario's name; in any other file the name is the stem of the path.
    return _extended(data, {}, str(file), ()), as_name(file.stem), file.resolve().parent


def _is_file(text: str) -> bool:
    return "/" in text or text.endswith((".yaml", ".yml"))


def _packaged(name: str, extending: tuple[str, ...] = (), siblings: Iterable[str] = (), where: str = "") -> _Layers:
    """A scenario of the package, which no user has given; `where` extends it, empty for that of the command line."""
    names = scenario_names()
    if name not in names and where:
        there = ", ".join([*siblings, *names])
        raise InputError(f"{where}.extends: there is no scenario {shown(name)} in that file or the package: {there}")
    if name not in names:
        folder = f"; {name} is a folder, give a YAML file in it" if os.path.isdir(name) else ", or give a YAML file"
        raise InputError(f"unknown scenario {shown(name)}; there are {', '.join(names)}{folder}")
    data, _ = _extended(_map(read_yaml(_PACKAGED / f"{name}.yaml"), name), {}, name, (*extending, name))
    return data, {}


def _extended(data: dict[str, Any], siblings: dict[str, Any], where: str, extending: tuple[str, ...]) -> _Layers:
    """`data` merged into the scenario that it extends, and that one into its own; `extending` is the chain so far."""
    if not data:
        raise InputError(f"{where} holds no scenario: at least `extends: NAME` or `system: NAME` is needed")
    if "extends" not in data:
        return _merged({}, data, where), data
    base = data["extends"]
    if not isinstance(base, str):
        raise InputError(f"{where}.extends must be the name of a scenario, given {shown(base)}")
    if base in extending:
        raise InputError(f"{where} extends itself: {' -> '.join((*extending, base))}")
    if base in siblings:
        place = f"{where.rpartition(':')[0]}:{base}"
        parent, given = _extended(_map(siblings[base], place), siblings, place, (*extending, base))
    else:
        parent, given = _packaged(base, extending, siblings, where)
    # A scenario's own name and description are not inherited.
    inherited = {key: value for key, value in parent.items() if key not in ("name", "description")}
    own = {key: value for key, value in data.items() if key != "extends"}
    return _merged(inherited, own, where), merge(given, own)


def _merged(base: dict[str, Any], over: dict[str, Any], where: str) -> dict[str, Any]:
    """`base` with the values of `over`; raises `InputError` for a null in place of a barrier that is not in `base`."""
    here, changes = base.get("barriers"), over.get("barriers")
    names = [name for name, barrier in here.items() if barrier is not None] if isinstance(here, dict) else []
    for name, barrier in changes.items() if isinstance(changes, dict) else ():
        if barrier is None and name not in names:
            there = _listed(names) or "none"
            raise InputError(f"{where}: barriers.{name}: null removes a barrier, but there is {there} to remove")
    merged: dict[str, Any] = merge(base, over)
    return merged


def _listed(names: Iterable[Any]) -> str:
    return ", ".join(sorted(map(str, names)))


def _map(data: Any, where: str) -> dict[str, Any]:
    if not isinstance(data, dict | None):
        raise InputError(f"{where} must be a YAML map of scenario keys, given {shown(data)}")
    return data or {}


def _anchored(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The data with the paths of a robot and a terminal set, which are relative to `folder`, absolute."""
    robot, mpc = data.get("robot"), data.get("mpc")
    if isinstance(robot, str) and _is_file(robot):
        data = {**data, "robot": str((folder / robot).resolve())}
    if isinstance(mpc, dict) and isinstance(mpc.get("terminal_set"), str):
        data = {**data, "mpc": {**mpc, "terminal_set": str((folder / mpc["terminal_set"]).resolve())}}
    return data
