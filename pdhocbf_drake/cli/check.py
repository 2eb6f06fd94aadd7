"""`pdhocbf check`: whether a robot's file fits its model, and a walk its robot."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pdhocbf_drake.arguments import add_overrides
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.robot.locate import robot_names
from pdhocbf_drake.simulation.scenario_file import load_fitted, load_written, scenario_names
from pdhocbf_drake.terminal import table
from pdhocbf_drake.yaml_text import parse_settings, read_yaml

if TYPE_CHECKING:
    from pdhocbf_drake.fitting.findings import Finding

_WALK = "walking"  # the scenario in which a robot alone is checked


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A robot or a scenario."""
    text = f"a robot YAML file or name, which is checked in the scenario {_WALK!r}; or a scenario as for `pdhocbf run`"
    parser.add_argument("what", metavar="ROBOT|SCENARIO", help=text)
    add_overrides(parser)
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")


def run(options: argparse.Namespace) -> int:
    """Prints one line a check; 1 if there is a fault."""
    found = list(_findings(options.what, options.text))
    if options.json:
        print(json.dumps([finding.to_dict() for finding in found], indent=2))
    else:
        rows = [
            (finding.level, finding.check, finding.said if finding.level == "ok" else finding.cure) for finding in found
        ]
        print(table(rows))
    return int(any(finding.level == "fault" for finding in found))


def _findings(what: str, text: str) -> Iterator[Finding]:
    """Those of the robot's file; and where it can be used, those of the walk."""
    name, text = _scenario(what, text)
    written = load_written(name, text)
    if written.scenario.system != "biped":
        raise InputError(f"only a robot's walk can be checked; {written.where} is of system {written.scenario.system}")
    from pdhocbf_drake.fitting.robot_checks import robot_findings  # here and below, for a quick start

    found = robot_findings(written.scenario.robot)
    yield from found
    if all(finding.level != "fault" for finding in found):
        yield from _of_walk(name, text)


def _of_walk(name: str, text: str) -> Iterator[Finding]:
    from pdhocbf_drake.fitting.findings import Finding
    from pdhocbf_drake.robot import Biped
    from pdhocbf_drake.simulation.limits import findings_within_limits

    scenario, fitted = load_fitted(name, text)
    for reason in fitted.reasons if fitted else ():
        yield Finding("default step", "ok", "gait.stride, gait.ticks_per_step", reason)
    yield from findings_within_limits(scenario, Biped.load(scenario.robot))


def _scenario(what: str, text: str) -> tuple[str, str]:
    """The scenario to load and its overrides; a robot is that of the scenario `_WALK`."""
    if what not in robot_names() and not _is_robot_file(what):
        return what, text
    overrides = parse_settings(text, "--text") if text else {}
    robot = what if what in robot_names() else str(Path(what).expanduser().resolve())
    return _WALK, json.dumps({**overrides, "robot": robot})


def _is_robot_file(what: str) -> bool:
    path = Path(what).expanduser()
    if what in scenario_names() or not path.is_file():
        return False
    data: Any = read_yaml(path)
    return isinstance(data, dict) and "model" in data and "robot" not in data
