"""What a run is called in its summary and on its pages."""

from __future__ import annotations

from pdhocbf_drake.robot.locate import load_robot_config
from pdhocbf_drake.simulation.scenario import DEFAULT_ROBOT, Scenario


def robot_of(scenario: Scenario) -> str | None:
    """The name of a walk's robot; the path of one that is called as the packaged one is; None without a robot."""
    if scenario.system != "biped":
        return None
    if scenario.robot == DEFAULT_ROBOT:
        return DEFAULT_ROBOT
    name = load_robot_config(scenario.robot).name
    return scenario.robot if name == DEFAULT_ROBOT else name


def title_of(scenario: Scenario) -> str:
    """The scenario's name, with its robot where that is not the packaged one."""
    robot = robot_of(scenario)
    return scenario.name if robot in (None, DEFAULT_ROBOT) else f"{scenario.name}, robot {robot}"
