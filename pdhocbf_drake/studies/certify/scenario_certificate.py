"""The certificate of a scenario: those of both axes of its walk."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from pdhocbf_drake.mpc.config import Box, MpcConfig, RobustConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.orbit import nominal_walk
from pdhocbf_drake.mpc.robust import check_boxes, enforced_barrier
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.build import Walk, build_walk, even_climbs
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.sensed import sensed
from pdhocbf_drake.studies.certify.certificate import AxisCertificate, certify_axis
from pdhocbf_drake.studies.certify.disturbed import Disturbance
from pdhocbf_drake.studies.shared.stepping_template import com_reach, stepping_template
from pdhocbf_drake.walking import Gait, GaitConfig
from pdhocbf_drake.walking.vhip import Vhip


@dataclass(frozen=True)
class ScenarioCertificate:
    """The certified sets of a scenario's walk.

    Attributes:
        scenario: the scenario, without a terminal set.
        walk: its gait, barriers and controller.
        reach: how far the CoM may be from the stance foot, along either axis [m].
        mass: of the robot or the template [kg]; an impulse is this times a change of velocity.
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
    disturbance: Box | RobustConfig | None = None,
    search: bool = True,
) -> ScenarioCertificate:
    """Certifies both axes of a scenario's walk.

    Args:
        scenario: a walk, on the robot or on the template.
        reach: of the CoM from the stance foot [m]; by default half the longest stride of the robot.
        with_rows: certify the ψ rows as well.
        report: called with the number of stages that are done, of three, and the name of the next one.
        disturbance: half-widths of what a tick may add to the CoM and to its velocity, along x and y [m, m/s], or all
            that a `RobustConfig` says of that.
        search: as in `certify_axis`.

    Raises:
        InputError: the scenario can't be built or certified. ModelError: nor its robot.
    """
    if scenario.mpc.terminal_set is not None:  # certifying makes a new one
        mpc = scenario.mpc.model_copy(update={"terminal_set": None})
        scenario = scenario.model_copy(update={"mpc": mpc})
    report(0, "walk and nominal orbit")
    walk = build_walk(scenario)
    mass = scenario.vhip.mass
    if scenario.system == "biped":
        mass = Biped.load(scenario.robot).mass
    reach = com_reach(scenario) if reach is None else reach
    gait, mpc, rise = _even_ground(scenario, walk)
    axes, given = [], _disturbances(disturbance, scenario)
    for axis in (0, 1):
        template = stepping_template(gait, mpc, axis, reach, rise)
        report(1 + axis, f"sets along {'xy'[axis]}")
        axes.append(
            certify_axis(
                template, walk.mpc.barriers[axis], with_rows, given[axis], search,
                partial(enforced_barrier, vhip=walk.vhip, config=mpc, axis=axis),
            )
        )  # fmt: skip
    return ScenarioCertificate(scenario, walk, reach, mass, _free_orbit(gait, mpc, rise), (axes[0], axes[1]))


def _disturbances(given: Box | RobustConfig | None, scenario: Scenario) -> Sequence[Disturbance | None]:
    """Those along x and y; none along either axis where no tick adds anything."""
    if given is None:
        return None, None
    robust = given if isinstance(given, RobustConfig) else RobustConfig(disturbance=given)
    missed, delay = robust.errors if robust.innovations else (0.0, 0.0), sensed(scenario).delay_ticks
    pair = [Disturbance(robust.boxes(axis), delay, missed) for axis in (0, 1)]
    if not any(np.any(part.boxes) for part in pair):
        return None, None
    for axis, part in enumerate(pair):
        check_boxes(part.boxes, scenario.gait.ticks_per_step, f"the disturbance along {'xy'[axis]}")
    return pair


def _even_ground(scenario: Scenario, walk: Walk) -> tuple[GaitConfig, MpcConfig, float]:
    """The walk that is certified, and the rise of its steps: on known stairs the steepest ones, else level ground.

    On stairs the feet stand in the middle of the treads, so that the sets hold wherever else on them a foot may land.
    """
    climbs = even_climbs(walk.gait)
    if not climbs:
        return scenario.gait, sensed(scenario), 0.0
    stride, rise = max(climbs, key=lambda climb: abs(climb[1]))
    tolerance = (0.0, scenario.mpc.step_tolerance[1])
    gait = scenario.gait.model_copy(update={"stride": stride})
    return gait, sensed(scenario).model_copy(update={"step_tolerance": tolerance}), rise


def _free_orbit(config: GaitConfig, mpc: MpcConfig, rise: float) -> np.ndarray:
    """c, v, p of the nominal walk without barriers and without an end, shape (2, 2N, 3); see `nominal_walk`."""
    gait = Gait(config.model_copy(update={"walk_steps": None}))
    return nominal_walk(gait, PeriodicMpc(gait, Vhip(gait.eta(rise), config.tick), mpc, ([], [])))
