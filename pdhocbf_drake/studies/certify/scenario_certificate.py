"""The certificate of a scenario: both axes of its walk, with its barriers and the reach of its robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.orbit import nominal_walk
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.reach import longest_stride
from pdhocbf_drake.simulation.build import Walk, build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.studies.certify.certificate import AxisCertificate, certify_axis
from pdhocbf_drake.studies.certify.stepping_template import stepping_template
from pdhocbf_drake.walking import Gait

STAGES = 3
"""Stages of `certify_scenario`: the walk, then the sets along x and y."""
TEMPLATE_REACH = 0.23
"""Reach of the CoM from the stance foot where there is no robot [m]: what our biped's legs allow."""


@dataclass(frozen=True)
class ScenarioCertificate:
    """The certified sets of a scenario's walk.

    Attributes:
        scenario: the scenario, without a terminal set.
        walk: its gait, barriers and controller.
        reach: how far the CoM may be from the stance foot, along either axis [m].
        mass: of the robot or the template [kg]; impulses are this times a change of velocity.
        orbit: c, v, p of the nominal walk without barriers, c and p from the stance foot, shape (2, 2N, 3).
        axes: the certificates along x and y.
    """

    scenario: Scenario
    walk: Walk
    reach: float
    mass: float
    orbit: np.ndarray
    axes: tuple[AxisCertificate, AxisCertificate]

    @property
    def main_axis(self) -> int:
        """The axis with the barriers; x where there are none."""
        return min(self.walk.axes, default=0)


def certify_scenario(
    scenario: Scenario,
    reach: float | None = None,
    with_rows: bool = True,
    report: Callable[[int, str], None] = lambda done, stage: None,
) -> ScenarioCertificate:
    """Certifies both axes of a scenario's walk.

    Args:
        scenario: a walk, on the robot or on the template.
        reach: of the CoM from the stance foot [m]; by default half the longest stride of the robot.
        with_rows: certify the ψ rows as well.
        report: called with the number of stages that are done, of `STAGES`, and the name of the next one.

    Raises:
        InputError: the scenario is no walk, or can't be built or certified. ModelError: nor its robot.
    """
    if scenario.system == "van_der_pol":
        raise InputError(
            f"scenario '{scenario.name}' is no walk; another system is certified from a file with A, B and limits"
        )
    if scenario.mpc.terminal_set is not None:  # certifying makes a new one
        mpc = scenario.mpc.model_copy(update={"terminal_set": None})
        scenario = scenario.model_copy(update={"mpc": mpc})
    report(0, "walk and nominal orbit")
    walk = build_walk(scenario)
    mass = scenario.vhip.mass
    if scenario.system == "biped":
        biped = Biped.load(scenario.robot)
        mass = biped.mass
        if reach is None:
            height = scenario.gait.com_height + scenario.gait.com_height_amplitude
            reach = longest_stride(biped, scenario.gait.stance_width, height) / 2.0
    reach = TEMPLATE_REACH if reach is None else reach
    axes = []
    for axis in (0, 1):
        template = stepping_template(scenario.gait, scenario.mpc, axis, reach)
        barriers = [barrier for on, barrier in zip(walk.axes, walk.barriers, strict=True) if on == axis]
        report(1 + axis, f"sets along {'xy'[axis]}")
        axes.append(certify_axis(template, barriers, with_rows))
    return ScenarioCertificate(scenario, walk, reach, mass, orbit_of_walk(scenario), (axes[0], axes[1]))


def orbit_of_walk(scenario: Scenario) -> np.ndarray:
    """c, v, p of the nominal walk without barriers and without an end, shape (2, 2N, 3); see `nominal_walk`."""
    gait = Gait(scenario.gait.model_copy(update={"walk_steps": None}))
    walk = build_walk(scenario.model_copy(update={"barriers": {}}))
    return nominal_walk(gait, PeriodicMpc(gait, walk.vhip, scenario.mpc, ([], [])))
