"""One gait, measured: a walk in steady state, the pushes that it survives, and its certified set."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pdhocbf_drake.analysis.feet import zmp_margins
from pdhocbf_drake.analysis.plan_frame import plan_over_stance
from pdhocbf_drake.analysis.robot_limits import robot_limits
from pdhocbf_drake.errors import PdhocbfError
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.robot.per_joint import ROLES
from pdhocbf_drake.sets.invariant_set import invariant_set
from pdhocbf_drake.simulation.run_log import FINISHED, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.shared.cases import PERIODIC
from pdhocbf_drake.studies.shared.gait_variants import Work
from pdhocbf_drake.studies.shared.push_search import Settings, search_all
from pdhocbf_drake.studies.shared.stepping_template import area, com_reach, stepping_template
from pdhocbf_drake.walking.support import contains

SETTLING_GAITS, WATCHED_GAITS = 3, 4
_PUSH = Settings(tolerance=1.0, duration=0.1, watch=3.2)
_ROUNDING = 1e-9  # [m]: a template keeps its box to that


class GaitMeasures(NamedTuple):
    """A gait in steady state; everything is null where it doesn't exist, or where the walk ended early.

    Attributes:
        values: the gait's parameters that were varied.
        ending: how the walk ended, or why the gait can't be built.
        speed: mean over whole gaits [m/s].
        torque: largest of each role's joints [N m].
        joint_speed: largest of each role's joints [rad/s].
        zmp_outside: share of the samples with the ZMP outside its box [1].
        zmp_inside: least distance of the ZMP from the edge of its box, negative outside [m].
        zmp_beyond: by how far it is outside at most [m].
        zmp_margin: the robot's least distance of the ZMP from the edge of its support, the start included [m].
        h_min: the least of each barrier [unit of h].
        push: largest impulse survived, the median over the phases, by direction [N s].
        certified_area: area in (c, v) of the states along x from which one can walk on for ever, mean over the phases,
            without barriers [m²/s].
    """

    values: dict[str, Any]
    ending: str
    speed: float | None = None
    torque: dict[str, float] | None = None
    joint_speed: dict[str, float] | None = None
    zmp_outside: float | None = None
    zmp_inside: float | None = None
    zmp_beyond: float | None = None
    zmp_margin: float | None = None
    h_min: dict[str, float] | None = None
    push: dict[str, float] | None = None
    certified_area: float | None = None


def measure(work: Work) -> GaitMeasures:
    """Measures one gait; a gait that can't be built or falls is a result too."""
    scenario = Scenario.model_validate_json(work.scenario)
    ticks = scenario.gait.ticks_per_gait
    settled = scenario.gait.start_steps * scenario.gait.ticks_per_step + SETTLING_GAITS * ticks
    duration = (settled + WATCHED_GAITS * ticks) * scenario.gait.tick
    try:
        log = simulate(scenario.model_copy(update={"duration": duration}))
        if log.ending != FINISHED:
            return GaitMeasures(work.values, log.ending, certified_area=certified_area(scenario))
        limits = robot_limits(scenario)
        return GaitMeasures(
            work.values,
            log.ending,
            **steady_walk(scenario, log.after(settled * scenario.gait.tick)),
            zmp_margin=None if limits is None else float(zmp_margins(log, limits.sole_half).min()),
            push=_pushes(scenario, work),
            certified_area=certified_area(scenario),
        )
    except PdhocbfError as error:
        return GaitMeasures(work.values, str(error))


def steady_walk(scenario: Scenario, log: RunLog) -> dict[str, Any]:
    """speed, torque, joint_speed, those of the ZMP's box, and h_min of `GaitMeasures`, from a log of whole gaits."""
    log = plan_over_stance(log)
    com = log.element("lip_state", "x")
    zmp = np.stack([log.element("lip_state", f"{axis}_zmp") for axis in "xy"], axis=1)
    box = log["zmp_box"].reshape(-1, 2, 2)
    inside = float(np.minimum(zmp - box[..., 0], box[..., 1] - zmp).min())
    robot = "actuation" in log
    return {
        "speed": float((com[-1] - com[0]) / (log.time[-1] - log.time[0])),
        "torque": peaks_by_role(log["actuation"]) if robot else None,
        "joint_speed": peaks_by_role(log["joint_state"][:, 12:]) if robot else None,
        "zmp_outside": float(1.0 - contains(box, zmp, _ROUNDING).mean()),
        "zmp_inside": inside,
        "zmp_beyond": max(0.0, -inside),
        "h_min": {name: float(log["h"][:, i].min()) for i, name in enumerate(scenario.barriers)},
    }


def peaks_by_role(values: np.ndarray) -> dict[str, float]:
    """Largest magnitude of each role's joints over time, from values (T, 12)."""
    peaks = np.abs(values).max(axis=0).reshape(2, len(ROLES)).max(axis=0)
    return dict(zip(ROLES, peaks.tolist(), strict=True))


def _pushes(scenario: Scenario, work: Work) -> dict[str, float] | None:
    if not work.directions:
        return None
    mass = Biped.load(scenario.robot).mass
    searches = search_all(scenario, [PERIODIC], work.directions, work.phases, _PUSH, 1, mass)
    found = [impulse for impulses in searches for impulse in impulses]
    by_way = {way: [i.survived for i in found if i.direction == way] for way in work.directions}
    return {way: float(np.median(values)) for way, values in by_way.items()}


def certified_area(scenario: Scenario) -> float | None:
    """Area of the certified sections along x without barriers, mean over the phases; None where there is no set."""
    template = stepping_template(scenario.gait, scenario.mpc, 0, com_reach(scenario))
    found = invariant_set(template.system, template.states, template.inputs)
    if not found.enforceable:
        return None
    return float(np.mean([area(template.section(found, phase)) for phase in range(template.period)]))
