"""The layers of a scenario: what a file or the package says, merged into what it extends.

A file holds one scenario, or several under their names (`FILE:NAME`). The keys after `extends: NAME` are merged in
depth into another scenario, of the same file or of the package; `extends: FILE` or `FILE:NAME` is one of another file,
whose path is relative to the folder of the file that extends it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from pdhocbf_drake.config import as_name
from pdhocbf_drake.config_errors import shown
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.yaml_text import merge, read_yaml

PACKAGED = Path(__file__).resolve().parent.parent / "scenarios"
"""The folder of the package's scenarios."""
_Layers = tuple[dict[str, Any], dict[str, Any]]  # a scenario's values, and the keys that a user's file gives


def scenario_names() -> list[str]:
    """Names of the package's scenarios."""
    return sorted(path.stem for path in PACKAGED.glob("*.yaml"))


class _Place(NamedTuple):
    """Where a scenario's data are.

    Attributes:
        where: in messages; empty for the command line.
        file: None is the package.
        entry: its name in that file; None where the file holds one scenario.
        chain: the scenarios on the way to it, each of which extends the next: file, entry, and its name in messages.
        siblings: the scenarios of that file.
    """

    where: str
    file: Path | None = None
    entry: str | None = None
    chain: tuple[tuple[Path | None, str | None, str], ...] = ()
    siblings: dict[str, Any] = {}  # noqa: RUF012

    def next(self, where: str, shown_as: str, file: Path | None, entry: str | None, siblings: dict[str, Any]) -> _Place:
        """That of a scenario which this one extends; raises `InputError` if that one leads back to itself."""
        resolved = None if file is None else file.resolve()
        chain = (*self.chain, (resolved, entry, shown_as))
        if any((resolved, entry) == (other, name) for other, name, _ in self.chain):
            raise InputError(f"{self.where} extends itself: {' -> '.join(name for *_, name in chain)}")
        return _Place(where, file, entry, chain, siblings)


_START = _Place("")


def find_layers(scenario: str) -> tuple[_Layers, str]:
    """Layers and name of a packaged scenario, or of the one at FILE or FILE:NAME."""
    file, entry = _file_and_entry(scenario)
    if file is None:
        return _packaged(scenario, _START), scenario
    # A run folder's scenario.yaml holds the scenario's name; in any other file the name is the stem of the path.
    return _of_file(file, entry, scenario, _START), as_name(file.stem if entry is None else entry)


def _file_and_entry(scenario: str) -> tuple[Path | None, str | None]:
    """The parts of FILE or FILE:NAME; no file for the name of a scenario."""
    head, _, entry = scenario.rpartition(":")
    if _is_file(head):
        return Path(head), entry
    return (Path(scenario) if _is_file(scenario) else None), None


def _is_file(text: str) -> bool:
    return "/" in text or text.endswith((".yaml", ".yml"))


def _of_file(file: Path, entry: str | None, shown_as: str, before: _Place) -> _Layers:
    """The scenario of a file, or the one called `entry` of several; `before` extends it."""
    data = _map(read_yaml(file), str(file))
    if entry is not None:
        if entry not in data:
            raise InputError(f"{file} has no scenario {shown(entry)}; it has {_listed(data)}")
        where = f"{file}:{entry}"
        label = entry if before is _START else shown_as
        return _extended(_map(data[entry], where), before.next(where, label, file, entry, data))
    if data and not set(data) & {*Scenario.model_fields, "extends"} and all(isinstance(v, dict) for v in data.values()):
        raise InputError(f"{file} holds several scenarios; choose one as {file}:NAME from {_listed(data)}")
    return _extended(data, before.next(str(file), shown_as, file, None, {}))


def _packaged(name: str, before: _Place) -> _Layers:
    """A scenario of the package, which no user has given; `before` extends it."""
    names = scenario_names()
    if name not in names and before.where:
        there = ", ".join([*before.siblings, *names])
        raise InputError(
            f"{before.where}.extends: there is no scenario {shown(name)} in that file or the package: {there}; one of "
            "another file is FILE.yaml or FILE.yaml:NAME"
        )
    if name not in names:
        folder = f"; {name} is a folder, give a YAML file in it" if os.path.isdir(name) else ", or give a YAML file"
        raise InputError(f"unknown scenario {shown(name)}; there are {', '.join(names)}{folder}")
    data, _ = _extended(_map(read_yaml(PACKAGED / f"{name}.yaml"), name), before.next(name, name, None, name, {}))
    return data, {}


def _extended(data: dict[str, Any], place: _Place) -> _Layers:
    """`data` merged into the scenario that it extends, and that one into its own."""
    where = place.where
    if not data:
        raise InputError(f"{where} holds no scenario: at least `extends: NAME` or `system: NAME` is needed")
    data = anchored(data, PACKAGED if place.file is None else place.file.resolve().parent)
    if "extends" not in data:
        return merged({}, data, where), data
    base = data["extends"]
    if not isinstance(base, str):
        raise InputError(f"{where}.extends must be the name of a scenario, given {shown(base)}")
    parent, given = _base(base, place)
    # A scenario's own name and description are not inherited.
    inherited = {key: value for key, value in parent.items() if key not in ("name", "description")}
    own = {key: value for key, value in data.items() if key != "extends"}
    return merged(inherited, own, where), merge(given, own)


def _base(base: str, place: _Place) -> _Layers:
    """The scenario that the one at a place extends: one of its file, of another file, or of the package."""
    if base in place.siblings:
        where = f"{place.where.rpartition(':')[0]}:{base}"
        siblings = place.siblings
        return _extended(_map(siblings[base], where), place.next(where, base, place.file, base, siblings))
    file, entry = _file_and_entry(base)
    if file is None or place.file is None:
        return _packaged(base, place)
    file = place.file.resolve().parent / file.expanduser()
    if not file.exists():
        raise InputError(f"{place.where}.extends: file {file} does not exist")
    return _of_file(file, entry, base, place)


def merged(base: dict[str, Any], over: dict[str, Any], where: str) -> dict[str, Any]:
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


def anchored(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The data with the paths of a robot and a terminal set, which are relative to `folder`, absolute."""
    robot, mpc = data.get("robot"), data.get("mpc")
    if isinstance(robot, str) and _is_file(robot):
        data = {**data, "robot": str((folder / robot).resolve())}
    if isinstance(mpc, dict) and isinstance(mpc.get("terminal_set"), str):
        data = {**data, "mpc": {**mpc, "terminal_set": str((folder / mpc["terminal_set"]).resolve())}}
    return data
