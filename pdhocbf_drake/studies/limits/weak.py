"""A scenario's robot with other limits of its joints, and what its walk takes of them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.fitting.steady_motion import OutOfReach, steady_motion
from pdhocbf_drake.mpc.programs import ProgramCache
from pdhocbf_drake.robot import ROLES, Biped
from pdhocbf_drake.robot.locate import load_robot_config
from pdhocbf_drake.simulation.build import nominal_mpc
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.yaml_text import write_yaml


class Peaks(NamedTuple):
    """Largest torque and speed of each role in the steady walk, (6,) each [N m, rad/s]."""

    torque: tuple[float, ...]
    speed: tuple[float, ...]

    @classmethod
    def of(cls, scenario: Scenario) -> Peaks:
        """Those of a scenario's walk, without a simulation; raises `InputError` where it can't be walked."""
        motion = steady_motion(Biped.load(scenario.robot), nominal_mpc(scenario, scenario.gait.stride, ProgramCache()))
        if isinstance(motion, OutOfReach):
            raise InputError(f"scenario '{scenario.name}' can't be walked: {motion.reason}")
        torque, speed = (
            np.abs(values).max(axis=0).reshape(2, -1).max(axis=0) for values in (motion.torques, motion.speeds)
        )
        return cls(tuple(torque.tolist()), tuple(speed.tolist()))


def write_weak(
    scenario: Scenario, torque: tuple[str, float] | None, speed: tuple[str, float] | None, file: Path
) -> Scenario:
    """The scenario with a robot whose role has that torque [N m] or speed [rad/s] on both legs, written to a file."""
    config, biped = load_robot_config(scenario.robot), Biped.load(scenario.robot)
    changes = {}
    for key, given, own in (
        ("effort_limits", torque, biped.effort_limits), ("velocity_limits", speed, biped.velocity_limits)
    ):  # fmt: skip
        if given is not None:
            role, value = given
            limits = own.reshape(2, -1).copy()
            limits[:, ROLES.index(role)] = value
            changes[key] = dict(zip(("left", "right"), limits.tolist(), strict=True))
    write_yaml(config.model_dump(mode="json") | changes, file)
    return scenario.model_copy(update={"robot": str(file)})
